"""Friction and drag that depend on the loading rate, rising or falling: thresholds in proportion, and a drag beside them."""

from backdrive_bayes.mechanics.effect import GrowthEffect

BREAKS = "rate independence"
STRIBECK = "Stribeck's law over a narrow range of rates; Armstrong-Hélouvry et al., Automatica 30, 1994"
GREASE = "a power of the rate, for greases about its root; Herschel and Bulkley, Kolloid-Zeitschrift 39, 1926"


class RateExponent(GrowthEffect):
    """Thresholds follow a power of the loading rate."""

    def present(self, context):
        """Some per cent for a factor e of the rate."""
        return 0.05


class ShaftDrag(GrowthEffect):
    """A drag before all parts, of seals and grease at the shaft, that rises or falls with the root of the loading rate."""

    def present(self, context):
        """Some thousandths of the largest torque between rest and the largest rate."""
        return 5e-3


FRICTION_RATE = RateExponent(
    "friction_rate", BREAKS, "width changes with the log of the rate, without relaxation", STRIBECK, parameter="friction_exponent"
)
DRAG_RATE = RateExponent(
    "drag_rate", BREAKS, "the drag of the clearance changes with the log of the rate", STRIBECK, parameter="drag_exponent", part=1
)
SHAFT_DRAG = ShaftDrag(
    "shaft_drag",
    BREAKS,
    "all crossing torques move apart with the root of the rate",
    GREASE,
    "N·m",
    parameter="shaft_drag",
    part=2,
    term=3,
)
