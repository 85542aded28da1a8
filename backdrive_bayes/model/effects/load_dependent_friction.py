"""Load-dependent friction on its own: what the baseline's friction has as a part, for baselines without it."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.hat_weights import hat_weights
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import BoundedLogNormal, Parameter
from backdrive_bayes.model.play import play

LOAD_RATIOS = np.array([0.0, 0.015, 0.04, 0.08, 0.15, 0.3, 0.55, 0.9])
MESH = "weakly informative; losses of a few per cent a mesh"


class LoadDependentFriction:
    """Play operators whose threshold is a share of the load, shares log-normal of mean ``load_friction_ratio``."""

    name = "load_dependent_friction"
    stage = Stage.TRANSMISSION
    signature = "the width of the loop grows in proportion to the load and vanishes at zero torque"
    source = "Coulomb friction of loaded meshes"
    parameters = (
        Parameter("load_friction_ratio", "1", "none", BoundedLogNormal(0.05, 1.0, 0.7), 0.0, MESH),
        Parameter("load_friction_spread", "1", "none", BoundedLogNormal(0.5, 0.5, 1.5), None, MESH),
    )

    def respond(self, values, drive):
        """Transmitted torque [N·m], shape (…, samples)."""
        ratio = drive.friction_factor * values["load_friction_ratio"]
        weights = hat_weights(LOAD_RATIOS, ratio, values["load_friction_spread"])
        passed = weights[..., :1] * drive.torque_nm
        for i, share in enumerate(LOAD_RATIOS[1:], 1):
            element = play(drive.path, lambda t, m=share: t - m * np.abs(t), np.zeros(1), drive.shift_nm)
            passed = passed + weights[..., i : i + 1] * element
        return drive.transmitted_nm + passed - drive.torque_nm
