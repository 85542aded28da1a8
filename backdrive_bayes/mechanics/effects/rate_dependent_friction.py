"""Friction and drag that depend on the loading rate, rising or falling, with a bend where the law has a minimum or saturates."""

from backdrive_bayes.mechanics.effect import GrowthEffect

SOURCE = "Stribeck's law over a narrow range of rates; Armstrong-Hélouvry et al., Automatica 30, 1994"


class RateExponent(GrowthEffect):
    """Thresholds follow a power of the loading rate."""

    def present(self, context):
        """Some per cent for a factor e of the rate."""
        return 0.05


class RateBend(GrowthEffect):
    """The exponent itself changes with the rate."""

    def present(self, context):
        """A third of the exponent's."""
        return 0.015


def _term(kind, name, signature, part, term):
    return kind(name, "rate independence", signature, SOURCE, parameter=name.replace("rate", "exponent"), part=part, term=term)


FRICTION_RATE = _term(RateExponent, "friction_rate", "width changes with the log of the rate, without relaxation", 0, 0)
DRAG_RATE = _term(RateExponent, "drag_rate", "the drag of the clearance changes with the log of the rate", 1, 0)
FRICTION_BEND = _term(RateBend, "friction_bend", "the width's law of the rate bends", 0, 1)
DRAG_BEND = _term(RateBend, "drag_bend", "the drag's law of the rate bends", 1, 1)
