"""The effects of the contact bench: a new one is a class and a line here."""

from __future__ import annotations

from backdrive_bayes.bench.contact.effects import channel, compliance, friction, series
from backdrive_bayes.bench.contact.unlisted import angle_channel, reducer_faults, torque_channel

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
    "mount_step": angle_channel.draw_step,
    "rocking_foot": angle_channel.draw_foot,
    "angle_scale": angle_channel.draw_scale,
    "missed_counts": angle_channel.draw_counts,
    "pitted_flank": reducer_faults.draw_pit,
    "broken_tooth": reducer_faults.draw_broken,
    "flank_wear": reducer_faults.draw_wear,
    "warming_contacts": reducer_faults.draw_warming,
    "eccentric_stage": reducer_faults.draw_eccentric,
    "torque_gain_wave": torque_channel.draw_gain,
    "torque_sensor_hysteresis": torque_channel.draw_hysteresis,
    "unseen_torque_ripple": torque_channel.draw_ripple,
}
"""Name of an effect whose answer is `unknown` -> draw(rng, reducer)."""
