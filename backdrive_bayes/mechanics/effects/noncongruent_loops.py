"""Friction and drag that follow the amplitude: relays have congruent loops, teeth and bearings under load have them nearly.
Part of every reducer, and no answer."""

from typing import ClassVar

from backdrive_bayes.mechanics.effect import GrowthEffect

USUAL, USUAL_BEND = 0.03, 0.01
"""Exponent of the amplitude of ordinary reducers, some per cent for a factor e, and the exponent's own change. A unit teaches
its own scales."""
SOURCE = "Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1 (congruency)"


class AmplitudeExponent(GrowthEffect):
    """Thresholds follow a power of the largest torque of a history."""

    of_class: ClassVar[bool] = True

    def present(self, context):
        """Some per cent for a factor e of the amplitude."""
        return USUAL


class AmplitudeBend(GrowthEffect):
    """The exponent itself changes with the amplitude."""

    of_class: ClassVar[bool] = True

    def present(self, context):
        """A third of the exponent's, as for a law of the rate."""
        return USUAL_BEND


def _term(kind, name, part, term):
    return kind(name, "none", "width changes with the amplitude", SOURCE, parameter=name, part=part, term=term)


FRICTION_AMPLITUDE = _term(AmplitudeExponent, "friction_amplitude", 0, 2)
DRAG_AMPLITUDE = _term(AmplitudeExponent, "drag_amplitude", 1, 2)
FRICTION_AMPLITUDE_BEND = _term(AmplitudeBend, "friction_amplitude_bend", 0, 3)
DRAG_AMPLITUDE_BEND = _term(AmplitudeBend, "drag_amplitude_bend", 1, 3)
