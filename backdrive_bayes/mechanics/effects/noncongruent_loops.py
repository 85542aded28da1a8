"""Friction and drag that follow the amplitude: relays have congruent loops, teeth and bearings under load have them nearly.
Part of every reducer, and no answer."""

from typing import ClassVar

from backdrive_bayes.mechanics.effect import GrowthEffect

USUAL = 0.03
"""Exponent of the amplitude of ordinary reducers: some per cent for a factor e. A unit teaches its own scale."""
SOURCE = "Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1 (congruency)"


class AmplitudeExponent(GrowthEffect):
    """Thresholds follow a power of the largest torque of a history."""

    of_class: ClassVar[bool] = True

    def present(self, context):
        """Some per cent for a factor e of the amplitude."""
        return USUAL


def _term(name, part):
    return AmplitudeExponent(name, "none", "width changes with the amplitude", SOURCE, parameter=name, part=part, term=2)


FRICTION_AMPLITUDE = _term("friction_amplitude", 0)
DRAG_AMPLITUDE = _term("drag_amplitude", 1)
