"""MJCF of coaxial bodies, and the engine's constraint rows as springs, stops, friction and dashpots.

With ``solref`` in its direct form, a step of 1 and full damping a soft constraint obeys f R = -(r + v + a), that is, it acts as a
backward-Euler spring of compliance R, and a friction row f R = -(v + a) as a dashpot 1/R up to its friction torque. R is
``invweight0`` (1-d)/d, d the impedance of ``solimp`` (MuJoCo documentation, "Computation: constraint model"). Explicit joint
springs and dampers would need inertia or break the solver's stops.
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.errors import MissingExtra

FULL = 0.9
"""Impedance of springs and stops at full load."""
REST_STEPS = 40
"""Steps without load in which the initial state comes to rest."""
PULL = 0.7
"""Share of a constraint's violation that one step corrects at most; below 1 keeps stiffening flanks from chattering."""


def load_engine():
    """The engine's Python package; raises MissingExtra."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtra("the bench 'mujoco'", "mujoco", "bench") from error
    return mujoco


def raise_if_unstable(data) -> None:
    """Raises FloatingPointError where the engine has warned: it starts anew by itself after an unstable step."""
    if any(warning.number for warning in data.warning):
        raise FloatingPointError("the engine found an unstable step")


def document(bodies: str, tendons: str, equalities: str) -> str:
    """A whole model, without gravity or contacts, with steps of 1."""
    return (
        "<mujoco><option timestep='1' gravity='0 0 0' integrator='Euler' solver='Newton' tolerance='1e-12' iterations='60'>"
        "<flag contact='disable' refsafe='disable' island='disable'/></option>"
        f"<worldbody>{bodies}</worldbody><tendon>{tendons}</tendon><equality>{equalities}</equality></mujoco>"
    )


def body(index: int, inertia: float, friction: float) -> str:
    """A body that turns about the common axis against friction [T_r]."""
    return (
        "<body><inertial pos='0 0 0' mass='1e-3' diaginertia='1e-9 1e-9 1e-9'/>"
        f"<joint name='p{index}' type='hinge' axis='0 0 1' armature='{inertia}' frictionloss='{friction}' "
        "solreffriction='-1 -1' solimpfriction='.9999 .9999 1 .5 1'/></body>"
    )


def twist(name: str, first: int, second: int | None = None, attributes: str = "") -> str:
    """The angle of a body, relative to another one if given, as a tendon."""
    other = "" if second is None else f"<joint joint='p{second}' coef='-1'/>"
    return f"<fixed name='{name}' {attributes}><joint joint='p{first}' coef='1'/>{other}</fixed>"


def stop(low: float, high: float, solimp: str) -> str:
    """Attributes of a twist that soft stops limit."""
    return f"limited='true' range='{low} {high}' solreflimit='{_reference()}' solimplimit='{solimp}'"


def spring(name: str, solimp: str, rest: float = 0.0) -> str:
    """A spring on a twist, with its angle at rest."""
    return f"<tendon tendon1='{name}' polycoef='{rest} 0 0 0 0' solref='{_reference()}' solimp='{solimp}'/>"


def dashpot() -> str:
    """Attributes of a twist that a dashpot damps."""
    return f"frictionloss='1e9' solreffriction='-1 {-FULL}' solimpfriction='{impedance()}'"


def impedance(stiffening: float = 1.0, deflection: float = 1.0) -> str:
    """Impedance rising up to ``deflection``: the secant stiffness goes as d²/(1-d), which shall rise by the stiffening ratio."""
    a = FULL**2 / (1.0 - FULL) / stiffening
    return f"{0.5 * (np.sqrt(a * a + 4.0 * a) - a)} {FULL} {deflection} .5 1"


def weight_of_compliance(compliance):
    """``invweight0`` of a spring or stop with this compliance at full load."""
    return PULL * FULL**2 / (1.0 - FULL) * compliance


def weight_of_dashpot(drag):
    """``invweight0`` of a dashpot with this torque per angle and step."""
    return FULL / (1.0 - FULL) / drag


def _reference():
    return f"{-PULL * FULL**2} {-FULL}"
