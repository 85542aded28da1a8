"""The effects that are known: a new one is a file and a line here, or an entry point of another package."""

from __future__ import annotations

from functools import lru_cache
from importlib.metadata import entry_points

from backdrive_bayes.mechanics.effect import Effect
from backdrive_bayes.mechanics.effects.asymmetric_stiffness import ASYMMETRIC_STIFFNESS, UNEQUAL_DEFLECTION, UNEQUAL_FLANKS
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS
from backdrive_bayes.mechanics.effects.noncongruent_loops import (
    DRAG_AMPLITUDE,
    DRAG_AMPLITUDE_BEND,
    FRICTION_AMPLITUDE,
    FRICTION_AMPLITUDE_BEND,
)
from backdrive_bayes.mechanics.effects.rate_dependent_friction import DRAG_RATE, FRICTION_RATE, SHAFT_DRAG
from backdrive_bayes.mechanics.effects.sensor_lag import LAG_SPREAD, SENSOR_LAG
from backdrive_bayes.mechanics.effects.thermal_drift import THERMAL_DRIFT
from backdrive_bayes.mechanics.effects.torque_offset import TORQUE_OFFSET
from backdrive_bayes.mechanics.effects.unexplained import UNEXPLAINED
from backdrive_bayes.mechanics.effects.viscoelastic_creep import VISCOELASTIC_CREEP

LIBRARY: dict[str, tuple[Effect, ...]] = {
    "torque_offset": (TORQUE_OFFSET,),
    "sensor_lag": (SENSOR_LAG, LAG_SPREAD),
    "rate_dependent_friction": (FRICTION_RATE, DRAG_RATE, SHAFT_DRAG),
    "thermal_drift": (THERMAL_DRIFT,),
    "asymmetric_stiffness": (ASYMMETRIC_STIFFNESS, UNEQUAL_DEFLECTION),
    "viscoelastic_creep": (VISCOELASTIC_CREEP,),
}
"""Effects by the name that an answer gives them, each with the terms that it consists of."""


@lru_cache(maxsize=1)
def all_effects() -> dict[str, tuple[Effect, ...]]:
    """The library and the effects of installed packages (entry point group backdrive_bayes.effects)."""
    found = dict(LIBRARY)
    for point in entry_points(group="backdrive_bayes.effects"):
        effect = point.load()
        terms = effect if isinstance(effect, tuple) else (effect,)
        found[terms[0].name] = terms
    return found


UNKNOWN = UNEXPLAINED
"""The process that stands for what no listed effect explains."""
BENCH = (BENCH_HYSTERESIS,)
"""What every bench has at trace level and no diagnosis can name."""
UNEQUAL = (UNEQUAL_FLANKS,)
"""What every reducer has at trace level and no diagnosis can name: the parts of two flanks are not quite alike. While modes are
searched it may be more, or the class is bent by what breaks its symmetry."""
NONCONGRUENT = (FRICTION_AMPLITUDE, DRAG_AMPLITUDE, FRICTION_AMPLITUDE_BEND, DRAG_AMPLITUDE_BEND)
"""What every reducer has at trace level beside the operator: loops of other amplitudes are not quite congruent."""
UNSEEN = (FRICTION_AMPLITUDE, DRAG_AMPLITUDE, FRICTION_RATE, DRAG_RATE)
"""What is supposed of amplitudes and of rates that were not seen: any reducer's thresholds may follow them."""
OPERATOR_PROPERTIES = ("second_backlash", "interface_slip")
"""Effects that lie inside the class: any fit holds them."""


def library_terms() -> tuple[Effect, ...]:
    """Every term of every listed effect, what every bench has and what every reducer has."""
    return (*(term for terms in all_effects().values() for term in terms), *BENCH, *UNEQUAL, *NONCONGRUENT)
