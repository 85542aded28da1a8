"""The effects of the engine bench by name: one line each."""

from __future__ import annotations

from backdrive_bayes.bench.engine import channel_effects as channel
from backdrive_bayes.bench.engine import series_effects as series
from backdrive_bayes.bench.engine import train_effects as train
from backdrive_bayes.bench.engine import unlisted_channel, unlisted_reducer

EFFECTS = {
    "interface_slip": series.draw_interface_slip,
    "viscoelastic_creep": series.draw_viscoelastic_creep,
    "asymmetric_stiffness": train.draw_asymmetric_stiffness,
    "second_backlash": series.draw_second_backlash,
    "sensor_lag": channel.draw_sensor_lag,
    "thermal_drift": channel.draw_thermal_drift,
    "torque_offset": channel.draw_torque_offset,
    "encoder_error": channel.draw_encoder_error,
    "stick_slip": train.draw_stick_slip,
    "rate_dependent_friction": train.draw_rate_dependent_friction,
    "load_dependent_friction": train.draw_load_dependent_friction,
    "hardening_stiffness": train.draw_hardening_stiffness,
}

UNLISTED = {
    "cogging": unlisted_reducer.draw_cogging,
    "mount_jump": unlisted_channel.draw_mount_jump,
    "lift_off": unlisted_reducer.draw_lift_off,
    "angle_scale": unlisted_channel.draw_angle_scale,
    "sensor_gain": unlisted_channel.draw_sensor_gain,
    "tooth_defect": unlisted_reducer.draw_tooth_defect,
    "mains_hum": unlisted_channel.draw_mains_hum,
    "warm_stiffness": unlisted_reducer.draw_warm_stiffness,
    "sensor_hysteresis": unlisted_channel.draw_sensor_hysteresis,
    "running_in": unlisted_reducer.draw_running_in,
}
