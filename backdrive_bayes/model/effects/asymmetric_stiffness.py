"""Asymmetric stiffness: the two flanks of the teeth differ."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogUniform, Normal, Parameter, Uniform


class AsymmetricStiffness:
    """Adds a (√(t² + τ_k²) - τ_k), t = max(|τ| - τ_0, 0), even in τ: compliance +a on one flank and -a on the other."""

    name = "asymmetric_stiffness"
    stage = Stage.COMPLIANCE
    signature = "an even function of torque: the two sides of the loop differ, the same at all rates"
    source = "flanks of different form, housing or bearing that yields more one way"
    parameters = (
        Parameter("flank_compliance", "rad/(N·m)", "compliance", Normal(0.08), 0.0, "some per cent of the mean compliance"),
        Parameter("flank_knee", "N·m", "torque", LogUniform(0.02, 2.0), None, "from a kink to a parabola within the rated range"),
        Parameter("flank_onset", "N·m", "torque", Uniform(0.0, 0.6), None, "from the first touch to beyond half the load"),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        knee = values["flank_knee"]
        beyond = np.maximum(np.abs(drive.transmitted_nm) - values["flank_onset"], 0.0)
        return values["flank_compliance"] * (np.sqrt(beyond**2 + knee**2) - knee)
