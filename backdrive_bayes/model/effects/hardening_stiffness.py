"""Hardening or softening on its own: what the baseline's elasticity has as a part, for baselines without it."""

from __future__ import annotations

from backdrive_bayes.model.bend import bent_line
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogUniform, Normal, Parameter


class HardeningStiffness:
    """Adds b (τ - τ_k tanh(τ/τ_k)): nothing at small torque, compliance b (negative: hardening) far above τ_k."""

    name = "hardening_stiffness"
    stage = Stage.COMPLIANCE
    signature = "the mean curve bends, odd in torque, the same at all rates"
    source = "load sharing of gear teeth; a₃τ³ of eq. (20), reconstructed"
    parameters = (
        Parameter("hardening_compliance", "rad/(N·m)", "compliance", Normal(0.2), 0.0, "some tenths of the mean compliance"),
        Parameter("hardening_knee", "N·m", "torque", LogUniform(0.1, 2.0), None, "bends within the rated range"),
    )

    def respond(self, values, drive):
        """Angle [rad], shape (…, samples)."""
        knee = values["hardening_knee"]
        more = values["hardening_compliance"]
        return bent_line(drive.transmitted_nm, knee, more, -more * knee)
