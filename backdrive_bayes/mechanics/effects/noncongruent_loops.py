"""Friction and drag that follow the amplitude: relays have congruent loops, teeth and bearings under load have them nearly.
Part of every reducer, and no answer."""

from typing import ClassVar

from backdrive_bayes.mechanics.effect import GrowthEffect

USUAL = 0.1
"""Prior standard deviation of the exponent of the amplitude, ten per cent for a factor e, and of its change. One weight of each
kind teaches nothing of a scale: it is not inferred."""
SOURCE = "Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1 (congruency)"


class AmplitudeGrowth(GrowthEffect):
    """Thresholds follow a power of the largest torque of a history, whose exponent changes with it."""

    of_class: ClassVar[bool] = True

    def present(self, context):
        """Some per cent for a factor e of the amplitude."""
        return USUAL


def _term(name, part, term):
    return AmplitudeGrowth(name, "none", "width changes with the amplitude", SOURCE, parameter=name, part=part, term=term)


FRICTION_AMPLITUDE = _term("friction_amplitude", 0, 1)
DRAG_AMPLITUDE = _term("drag_amplitude", 1, 1)
FRICTION_AMPLITUDE_BEND = _term("friction_amplitude_bend", 0, 2)
DRAG_AMPLITUDE_BEND = _term("drag_amplitude_bend", 1, 2)
