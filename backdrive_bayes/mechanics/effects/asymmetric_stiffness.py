"""The two flanks differ in stiffness."""

import numpy as np

from backdrive_bayes.mechanics.effect import FlankEffect, PathEffect
from backdrive_bayes.mechanics.history import played

NODES = np.array([0.0, 0.01, 0.03, 0.08, 0.16, 0.28, 0.45, 0.65, 0.85, 1.2])
BEHIND = (0.0, 0.02, 0.08, 0.3)
"""Thresholds of friction through which the even part may see the torque."""
SMOOTH = 1.5
"""Length over which the even slope changes with the root of the torque: stiffness bends over the whole range, damage does not."""


class AsymmetricStiffness(PathEffect):
    """An angle that is even in the torque, or in the torque behind friction, smooth in the root of its size."""

    def present(self, context):
        """Two per cent of the angle scale."""
        return 0.02

    def responses(self, history, record, context):
        """Even integrals of pieces of |z| under a smooth prior, for every threshold; behind friction at half the size."""
        root = np.sqrt(0.5 * (NODES[1:] + NODES[:-1]))
        near = np.exp(-0.5 * ((root[:, None] - root) / SMOOTH) ** 2)
        mixing = np.linalg.cholesky(near + 1e-6 * np.eye(root.size))
        begin, end = [], []
        for threshold in BEHIND:
            z = played(history.z0[0], history.z1, threshold)
            for found, ends in ((begin, z[:-1]), (end, z[1:])):
                pieces = np.clip(np.abs(ends)[:, None] - NODES[:-1], 0.0, np.diff(NODES)) @ mixing
                found.append(pieces * (0.5 if threshold else 1.0))
        return np.hstack(begin), np.hstack(end)


ASYMMETRIC_STIFFNESS = AsymmetricStiffness(
    "asymmetric_stiffness", "oddness", "even in the torque", "elastic deflection of two flanks", "rad"
)


class UnequalFlanks(FlankEffect):
    """Elasticity, friction and clearance each differ between the flanks by a share of themselves."""

    def present(self, context):
        """Five per cent."""
        return 0.05


UNEQUAL_FLANKS = UnequalFlanks("unequal_flanks", "oddness", "even in the torque, with hysteresis", "as for the stiffness", "1")
