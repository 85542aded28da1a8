"""The effects of the bench "ode": a new one is a class and a line here."""

from __future__ import annotations

from backdrive_bayes.bench.ode.effects import channel, clamp, compliance, friction, second_backlash, stick_slip
from backdrive_bayes.bench.ode.unlisted import faults, reading

EFFECTS = {
    "interface_slip": clamp.draw,
    "viscoelastic_creep": compliance.draw_creep,
    "asymmetric_stiffness": compliance.draw_asymmetric,
    "second_backlash": second_backlash.draw,
    "sensor_lag": channel.draw_lag,
    "thermal_drift": channel.draw_drift,
    "torque_offset": channel.draw_offset,
    "encoder_error": channel.draw_encoder,
    "stick_slip": stick_slip.draw,
    "rate_dependent_friction": friction.draw_rate,
    "load_dependent_friction": friction.draw_load,
    "hardening_stiffness": compliance.draw_hardening,
}
"""Name in the contract -> draw(rng, reducer) of an effect with strength 0."""

UNLISTED = {
    "mains_hum": reading.draw_hum,
    "mount_jump": reading.draw_jump,
    "angle_scale": reading.draw_scale,
    "mount_ringing": reading.draw_ringing,
    "warming_stiffness": faults.draw_warming,
    "running_in": faults.draw_running_in,
    "debris": faults.draw_debris,
    "loaded_runout": faults.draw_runout,
    "torque_sensor_hysteresis": faults.draw_sensor_hysteresis,
}
"""Name -> draw(rng, reducer) of an effect that no library lists."""
