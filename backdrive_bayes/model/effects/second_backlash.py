"""Second backlash: the clearance of another stage, crossed at a torque of its own."""

from __future__ import annotations

from backdrive_bayes.model.gap import Steps, positions_in_gap
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Parameter, Uniform

STAGE = "weakly informative: a stage with more preload than the first"


class SecondBacklash:
    """Play between the boundaries ±(c₂/2) tanh((τ ∓ τ_d2)/s₂): a second, narrow step once a direction."""

    name = "second_backlash"
    stage = Stage.COMPLIANCE
    signature = "a second step of the angle in each direction, at another torque than the first"
    source = "stages of a multi-stage planetary train in series"
    parameters = (
        Parameter("second_clearance", "rad", "angle", LogNormal(0.03, 1.2), 0.0, STAGE),
        Parameter("second_drag_torque", "N·m", "torque", LogUniform(0.08, 0.6), None, STAGE),
        # A wide step is friction, one at high load is slip.
        Parameter("second_engagement_torque", "N·m", "torque", LogUniform(0.003, 0.06), None, "a narrow step"),
        Parameter("initial_second_gap_position", "1", "none", Uniform(-1.0, 1.0), None, "the unit's past is unknown", True),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        drag, width = values["second_drag_torque"], values["second_engagement_torque"]
        steps = Steps((1.0, 0.0, 0.0), (drag, 0.0, 0.0), (width, 1.0, 1.0))
        place = 0.5 * (1 + values["initial_second_gap_position"])
        return 0.5 * values["second_clearance"] * positions_in_gap(drive, steps, place)
