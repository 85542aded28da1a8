"""The effects this bench can give a reducer: a new one is a class and a line here."""

from __future__ import annotations

from backdrive_bayes.bench.sliders.effects import channel, compliance, friction, series
from backdrive_bayes.bench.sliders.unlisted import angle_channel, reducer_faults, torque_channel

EFFECTS = {
    "interface_slip": series.draw_interface_slip,
    "viscoelastic_creep": compliance.draw_viscoelastic_creep,
    "asymmetric_stiffness": compliance.draw_asymmetric_stiffness,
    "second_backlash": series.draw_second_backlash,
    "sensor_lag": channel.draw_sensor_lag,
    "thermal_drift": channel.draw_thermal_drift,
    "torque_offset": channel.draw_torque_offset,
    "encoder_error": channel.draw_encoder_error,
    "stick_slip": friction.draw_stick_slip,
    "rate_dependent_friction": friction.draw_rate_dependent_friction,
    "load_dependent_friction": friction.draw_load_dependent_friction,
    "hardening_stiffness": compliance.draw_hardening_stiffness,
}
"""Name in the contract -> draw(rng, reducer) of an effect with strength 0."""

UNLISTED = {
    "mains_hum": angle_channel.draw_hum,
    "sensor_jump": angle_channel.draw_jump,
    "angle_scale": angle_channel.draw_scale,
    "tooth_defect": reducer_faults.draw_tooth,
    "temperature_stiffness": reducer_faults.draw_temperature,
    "amplitude_backlash": reducer_faults.draw_amplitude,
    "torque_gain_nonlinearity": torque_channel.draw_gain,
    "bistable_mount": angle_channel.draw_bistable,
    "drive_crosstalk": angle_channel.draw_crosstalk,
    "buffer_slip": angle_channel.draw_buffer,
    "missing_tooth": reducer_faults.draw_missing,
    "loaded_runout": reducer_faults.draw_runout,
    "wear": reducer_faults.draw_wear,
    "unseen_torque_ripple": torque_channel.draw_ripple,
    "torque_sensor_hysteresis": torque_channel.draw_hysteresis,
}
"""Name of an effect whose answer is `unknown` -> draw(rng, reducer); the later half is reserved for frozen diagnoses."""
