"""The effects the virtual bench can give a reducer: a new one is a file and a line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from backdrive_bayes.bench.effects import (
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
from backdrive_bayes.bench.unlisted import angle_channel, reducer_faults, torque_channel
from backdrive_bayes.errors import BadInput

UNKNOWN, NONE = "unknown", "none"

EFFECTS: dict[str, Callable] = {
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


@dataclass(frozen=True)
class Unlisted:
    """An effect whose answer is `unknown`; a ``reserved`` one is kept for tests after the diagnosis is frozen."""

    draw: Callable
    reserved: bool = False


UNLISTED: dict[str, Unlisted] = {
    "mains_hum": Unlisted(angle_channel.draw_hum),
    "sensor_jump": Unlisted(angle_channel.draw_jump),
    "angle_scale": Unlisted(angle_channel.draw_scale),
    "tooth_defect": Unlisted(reducer_faults.draw_tooth),
    "temperature_stiffness": Unlisted(reducer_faults.draw_temperature),
    "amplitude_backlash": Unlisted(reducer_faults.draw_amplitude),
    "torque_gain_nonlinearity": Unlisted(torque_channel.draw_gain),
    "bistable_mount": Unlisted(angle_channel.draw_bistable, reserved=True),
    "drive_crosstalk": Unlisted(angle_channel.draw_crosstalk, reserved=True),
    "buffer_slip": Unlisted(angle_channel.draw_buffer, reserved=True),
    "missing_tooth": Unlisted(reducer_faults.draw_missing, reserved=True),
    "loaded_runout": Unlisted(reducer_faults.draw_runout, reserved=True),
    "wear": Unlisted(reducer_faults.draw_wear, reserved=True),
    "unseen_torque_ripple": Unlisted(torque_channel.draw_ripple, reserved=True),
    "torque_sensor_hysteresis": Unlisted(torque_channel.draw_hysteresis, reserved=True),
}


def known_names() -> tuple[str, ...]:
    """Every name that can be asked for."""
    return (*EFFECTS, *UNLISTED, UNKNOWN, NONE)


def find_draw(name: str) -> Callable:
    """The draw of an effect by name; BadInput for any other."""
    if name in EFFECTS:
        return EFFECTS[name]
    if name in UNLISTED:
        return UNLISTED[name].draw
    raise BadInput("effect", f"one of {', '.join(known_names())}", f"'{name}'")


def pick_unlisted(rng, reserved: bool = False) -> str:
    """Name of an unlisted effect at random, from the open group or the reserved one."""
    return str(rng.choice([name for name, entry in UNLISTED.items() if entry.reserved == reserved]))


def answer(name: str) -> str:
    """What a diagnosis should say of an effect of this name."""
    return name if name in EFFECTS else UNKNOWN
