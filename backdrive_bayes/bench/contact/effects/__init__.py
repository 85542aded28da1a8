"""The effects that a diagnosis knows by name, one file each; a new one is a file and a line here."""

from backdrive_bayes.bench.contact.effects import (
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

_MODULES = (
    interface_slip,
    viscoelastic_creep,
    asymmetric_stiffness,
    second_backlash,
    sensor_lag,
    thermal_drift,
    torque_offset,
    encoder_error,
    stick_slip,
    rate_dependent_friction,
    load_dependent_friction,
    hardening_stiffness,
)

EFFECTS = {module.__name__.rpartition(".")[2]: module.draw for module in _MODULES}
"""Name in the contract -> draw(rng, reducer) of an effect with strength 0."""
