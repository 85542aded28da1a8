"""Elastic deflection: a monotone odd compliance, linear plus hardening or softening."""

from __future__ import annotations

from backdrive_bayes.model.bend import bent_line
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import LogNormal, LogUniform, Parameter

STEEL_TO_PLASTIC = "weakly informative: the peak angle over the rated torque, a factor of 2.7 either way"


class Elastic:
    """Single-valued deflection a(τ) = a∞τ + (a₀-a∞)τ_h tanh(τ/τ_h) of the transmitted torque.

    a₀ is the compliance at zero torque, a∞ = h·a₀ the compliance far above τ_h; both are positive, so the curve is
    monotone. Its expansion a₁τ + a₃τ³ + a₅τ⁵ is the elastic part of eq. (20), reconstructed.
    """

    name = "elastic"
    stage = Stage.COMPLIANCE
    signature = "angle in proportion to torque, on all branches alike"
    source = "eq. (17)-(18), reconstructed; doi:10.1177/00202940261442382"
    parameters = (
        Parameter("compliance", "rad/(N·m)", "compliance", LogNormal(0.6, 1.0), 0.0, STEEL_TO_PLASTIC),
        Parameter("hardening_ratio", "1", "none", LogNormal(1.0, 0.7), 1.0, "no preference for hardening or softening"),
        # A sharper bend would be a clearance without friction.
        Parameter("hardening_torque", "N·m", "torque", LogUniform(0.07, 1.0), None, "bends within the rated range"),
    )

    def respond(self, values, drive):
        """Angle [rad] of shape (…, samples)."""
        ratio, knee = values["hardening_ratio"], values["hardening_torque"]
        slope = values["compliance"] * ratio
        return bent_line(drive.transmitted_nm, knee, slope, (values["compliance"] - slope) * knee)
