"""Friction and drag that depend on the loading rate, of either sign."""

from backdrive_bayes.mechanics.effect import TangentEffect


class RateExponent(TangentEffect):
    """Thresholds follow a power of the loading rate."""

    def trace(self, context):
        """Less than a half per cent for a factor e of the rate."""
        return 4e-3

    def present(self, context):
        """Some per cent for a factor e of the rate."""
        return 0.05


FRICTION_RATE = RateExponent(
    "friction_rate", "rate independence", "width changes with the log of the rate, without relaxation",
    "Stribeck's law over a narrow range of rates; Armstrong-Hélouvry et al., Automatica 30, 1994", "1", True, False,
    "friction_exponent", 2e-3,
)
DRAG_RATE = RateExponent(
    "drag_rate", "rate independence", "the drag of the clearance changes with the log of the rate",
    "as for friction", "1", True, False, "drag_exponent", 2e-3,
)
