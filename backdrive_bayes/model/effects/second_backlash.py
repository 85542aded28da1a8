"""Second backlash: the clearance of another stage, crossed at a torque of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.model.gap import Steps, positions_in_gap
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Normal, Parameter, Uniform

STAGE = "weakly informative: a stage with more preload than the first"
PARTS = (-0.8, -0.4, 0.0, 0.4, 0.8)
"""Places p of equal shares of the teeth within the range of engagement; each engages over ``OWN_WIDTH`` of it."""
OWN_WIDTH = 0.4


class SecondBacklash:
    """A second, narrow step once a direction: teeth that float between two flanks and engage one after another.

    The share at place p of the range s₂ plays between the boundaries ±(c₂/2) tanh((τ - p s₂ ∓ τ_d2 (1 + u p))/0.4 s₂): where u is
    not zero the step is wider one way than the other.
    """

    name = "second_backlash"
    stage = Stage.COMPLIANCE
    signature = "a second step of the angle in each direction, at another torque than the first"
    source = "stages of a multi-stage planetary train in series"
    parameters = (
        Parameter("second_clearance", "rad", "angle", LogNormal(0.03, 1.2), 0.0, STAGE),
        Parameter("second_drag_torque", "N·m", "torque", LogUniform(0.08, 0.6), None, STAGE),
        # A wide step is friction, one at high load is slip.
        Parameter("second_engagement_torque", "N·m", "torque", LogUniform(0.003, 0.06), None, "a narrow step"),
        Parameter("second_unevenness", "1", "none", Normal(0.1), None, "drags alike to some tens of per cent"),
        Parameter("initial_second_gap_position", "1", "none", Uniform(-1.0, 1.0), None, "the unit's past is unknown", True),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        drag, width = values["second_drag_torque"], values["second_engagement_torque"]
        place, moved = 0.5 * (1 + values["initial_second_gap_position"]), 0.0
        for p in PARTS:
            held = drag * (1 + p * np.clip(values["second_unevenness"], -0.9, 0.9))
            steps = Steps((1.0, 0.0, 0.0), (held, 0.0, 0.0), (OWN_WIDTH * width, 1.0, 1.0))
            moved = moved + positions_in_gap(replace(drive, shift_nm=drive.shift_nm + p * width), steps, place)
        return 0.5 * values["second_clearance"] / len(PARTS) * moved
