"""The effects this bench can give a reducer: a new one is a file and a line here."""

from __future__ import annotations

from backdrive_bayes.bench.protocol import DrawEffect
from backdrive_bayes.bench.sliders.effects import (
    asymmetric_stiffness,
    encoder_error,
    hardening_stiffness,
    interface_slip,
    load_dependent_friction,
    rate_dependent_friction,
    second_backlash,
    sensor_lag,
    stick_slip,
    thermal_drift,
    torque_offset,
    viscoelastic_creep,
)
from backdrive_bayes.bench.sliders.unlisted import angle_channel, reducer_faults, torque_channel

EFFECTS: dict[str, DrawEffect] = {
    "interface_slip": interface_slip.draw,
    "viscoelastic_creep": viscoelastic_creep.draw,
    "asymmetric_stiffness": asymmetric_stiffness.draw,
    "second_backlash": second_backlash.draw,
    "sensor_lag": sensor_lag.draw,
    "thermal_drift": thermal_drift.draw,
    "torque_offset": torque_offset.draw,
    "encoder_error": encoder_error.draw,
    "stick_slip": stick_slip.draw,
    "rate_dependent_friction": rate_dependent_friction.draw,
    "load_dependent_friction": load_dependent_friction.draw,
    "hardening_stiffness": hardening_stiffness.draw,
}
"""Name in the contract -> draw(rng, reducer) of an effect with strength 0."""


UNLISTED: dict[str, DrawEffect] = {
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
