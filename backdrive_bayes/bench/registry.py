"""Names that a unit of any bench may be asked for, and what a diagnosis should answer to each."""

from __future__ import annotations

import math

from backdrive_bayes.bench.protocol import DrawEffect, Mechanics
from backdrive_bayes.errors import BadInput

UNKNOWN, NONE = "unknown", "none"

EFFECTS: dict[str, str] = {
    "interface_slip": "micro-slip of the output clamp",
    "viscoelastic_creep": "delayed compliance",
    "asymmetric_stiffness": "unequal flanks",
    "second_backlash": "a second stage's clearance",
    "sensor_lag": "late angle channel",
    "thermal_drift": "slow drift of the angle",
    "torque_offset": "zero error or dead weight",
    "encoder_error": "periodic interpolation error",
    "stick_slip": "small jumps",
    "rate_dependent_friction": "friction that follows the rate",
    "load_dependent_friction": "friction in proportion to load",
    "hardening_stiffness": "stiffness that changes with load",
}
"""Every listed effect, and what it is in a few words."""

MEMBERS = ("load_dependent_friction", "hardening_stiffness")
"""Effects that a reducer has by itself unless it is drawn without them."""


def known_names(mechanics: Mechanics) -> tuple[str, ...]:
    """Every name that can be asked for on this bench."""
    return (*mechanics.effects, *mechanics.unlisted, UNKNOWN, NONE)


def find_draw(mechanics: Mechanics, name: str) -> DrawEffect:
    """The draw of an effect by name; BadInput for any other."""
    found = mechanics.effects.get(name) or mechanics.unlisted.get(name)
    if found is None:
        raise BadInput("effect", f"one of {', '.join(known_names(mechanics))}", f"'{name}'")
    return found


def unlisted_names(mechanics: Mechanics, reserved: bool = False) -> tuple[str, ...]:
    """Unlisted effects of a bench: the earlier half, or the later one, which is kept for tests of a frozen diagnosis."""
    names = tuple(mechanics.unlisted)
    half = len(names) // 2
    return names[half:] if reserved else names[:half]


def choose_effects(rng, mechanics: Mechanics, asked, reserved: bool = False) -> dict[str, float]:
    """Effects by name -> severity above 0, 'unknown' replaced by an unlisted one at random; BadInput where that cannot be."""
    chosen = {}
    for name, severity in asked.items():
        if not (isinstance(severity, int | float) and math.isfinite(severity) and 0.0 <= severity <= 10.0):
            raise BadInput(f"severity of {name}", "a number from 0 to 10", severity)
        if name not in (UNKNOWN, NONE):
            find_draw(mechanics, name)
        if name != NONE and severity > 0:
            own = str(rng.choice(unlisted_names(mechanics, reserved))) if name == UNKNOWN else name
            chosen[own] = float(severity)
    if NONE in asked and len(asked) > 1:
        raise BadInput("effects", "'none' alone", ", ".join(asked))
    return chosen


def answer(name: str) -> str:
    """What a diagnosis should say of an effect of this name."""
    return name if name in EFFECTS else UNKNOWN
