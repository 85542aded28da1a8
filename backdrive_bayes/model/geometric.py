"""Geometric error: a clearance crossed when the torque overcomes a drag torque, engaged gradually."""

from __future__ import annotations

from backdrive_bayes.model.gap import Steps, positions_in_gap
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, Parameter, Uniform

CATALOGUE = "weakly informative; clearance, drag and engagement of small planetary stages in catalogues"


class Geometric:
    """Play-like operator whose boundaries are the engagement curves of the two flanks.

    The rising boundary is (c/2)[(1-e)(1-l) f(τ-τ_d, s) + (1-e) l f(τ-ρτ_d, s_l) + e f(τ+τ_e, s_e)] with f(x, s) = tanh(x/s), the
    falling one its mirror image. With e = l = 0 and a saturated loop these are the branches A tanh(Bτ ∓ D) of eq. (20),
    reconstructed, with A = c/2, B = 1/s, D = τ_d/s. The share l engages late, at ρ times the drag torque and over a narrower s_l
    (stages in series). The share e, a part ``release_share`` of what does not engage late, springs back already when the torque
    has fallen to τ_e, over a narrower s_e. The initial position runs from -1 to 1 between the boundaries at the first torque;
    teeth that share the clearance may have been left at different places: the share ``initial_gap_spread`` of them lies at the
    one flank or the other so as to give the same mean position.
    """

    name = "geometric"
    stage = Stage.COMPLIANCE
    signature = "a step of the angle where the torque overcomes the drag, once a direction"
    source = "eq. (19)-(20), reconstructed; doi:10.1177/00202940261442382"
    parameters = (
        Parameter("clearance", "rad", "angle", LogNormal(0.3, 1.5), 0.0, CATALOGUE),
        Parameter("drag_torque", "N·m", "torque", LogNormal(0.03, 1.0), None, CATALOGUE),
        Parameter("engagement_torque", "N·m", "torque", LogNormal(0.01, 1.0), None, CATALOGUE),
        Parameter("late_share", "1", "none", Uniform(0.0, 0.5), None, "no preference"),
        Parameter("late_drag_ratio", "1", "none", Uniform(1.0, 2.0), None, "a drag of the same kind"),
        Parameter("late_width_ratio", "1", "none", Uniform(0.2, 1.0), None, "no wider than the step itself"),
        Parameter("release_share", "1", "none", Uniform(0.0, 0.5), None, "no preference"),
        Parameter("release_torque", "N·m", "torque", LogNormal(0.02, 1.0), None, CATALOGUE),
        Parameter("release_width_ratio", "1", "none", Uniform(0.2, 1.0), None, "no wider than the step itself"),
        Parameter("initial_gap_position", "1", "none", Uniform(-1.0, 1.0), None, "the unit's past is unknown", True),
        Parameter("initial_gap_spread", "1", "none", Uniform(0.0, 1.0), None, "the unit's past is unknown", True),
    )

    def respond(self, values, drive):
        """Angle [rad] of shape (…, samples)."""
        drag, width, late = drive.drag_factor * values["drag_torque"], values["engagement_torque"], values["late_share"]
        share, release, narrow = values["release_share"], values["release_torque"], values["release_width_ratio"]
        # Never beyond the drag in its own width: the boundaries must not cross.
        release = narrow * drag * release / (drag + release)
        share = share * (1 - late)
        shares = ((1 - share) * (1 - late), (1 - share) * late, share)
        widths = (width, width * values["late_width_ratio"], width * narrow)
        steps = Steps(shares, (drag, drag * values["late_drag_ratio"], -release), widths)
        place = 0.5 * (1 + values["initial_gap_position"])
        gap = positions_in_gap(drive, steps, place, values["initial_gap_spread"])
        gap *= 0.5 * values["clearance"]
        return gap
