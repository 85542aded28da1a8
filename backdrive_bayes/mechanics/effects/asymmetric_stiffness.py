"""The two flanks differ in stiffness."""

import numpy as np

from backdrive_bayes.mechanics.effect import FlankEffect, PathEffect

NODES = np.array([0.0, 0.08, 0.25, 0.5, 0.75, 1.2])


class AsymmetricStiffness(PathEffect):
    """An angle that is even in the torque, smooth in |z|."""

    def trace(self, context):
        """A third of the angle noise over the whole range."""
        return 0.3 * context.angle_noise

    def present(self, context):
        """Two per cent of the angle scale."""
        return 0.02

    def responses(self, history, record, context):
        """Even integrals of pieces of |z| under a smooth prior."""
        centre = 0.5 * (NODES[1:] + NODES[:-1])
        mixing = np.linalg.cholesky(np.exp(-np.abs(centre[:, None] - centre) / 0.4))
        return tuple(np.clip(np.abs(z)[:, None] - NODES[:-1], 0.0, np.diff(NODES)) @ mixing for z in (history.z0, history.z1))


ASYMMETRIC_STIFFNESS = AsymmetricStiffness(
    "asymmetric_stiffness", "oddness", "even in the torque", "elastic deflection of two flanks", "rad"
)


class UnequalFlanks(FlankEffect):
    """Elasticity, friction and clearance each differ between the flanks by a share of themselves."""

    def trace(self, context):
        """A fifth of a per cent."""
        return 2e-3

    def present(self, context):
        """Five per cent."""
        return 0.05


UNEQUAL_FLANKS = UnequalFlanks("unequal_flanks", "oddness", "even in the torque, with hysteresis", "as for the stiffness", "1")
