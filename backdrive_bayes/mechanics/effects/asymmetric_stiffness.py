"""The two flanks differ in stiffness."""

import numpy as np

from backdrive_bayes.mechanics.effect import AngleEffect, FlankEffect, PathEffect

NODES = np.array([0.0, 0.01, 0.03, 0.08, 0.16, 0.28, 0.45, 0.65, 0.85, 1.2])
SMOOTH = 1.5
"""Length over which the even slope changes with the root of the torque or the angle: stiffness bends over the whole range, damage
does not."""
USUAL = 0.02
"""Usual size of either form, in shares of the angle scale: a choice, as sizes from a fifth of it to five times
are averaged over."""


def even(of) -> np.ndarray:
    """Even integrals (…, columns) of pieces of the size of torques or angles ``of`` (…,), smooth in its root."""
    root = np.sqrt(0.5 * (NODES[1:] + NODES[:-1]))
    near = np.exp(-0.5 * ((root[:, None] - root) / SMOOTH) ** 2)
    mixing = np.linalg.cholesky(near + 1e-6 * np.eye(root.size))
    return np.clip(np.abs(of)[..., None] - NODES[:-1], 0.0, np.diff(NODES)) @ mixing


class AsymmetricStiffness(PathEffect):
    """An angle that is even in the torque, smooth in the root of its size."""

    def present(self, context):
        """Two per cent of the angle scale."""
        return USUAL

    def responses(self, history, record, context):
        """Even integrals at the segments' ends."""
        return even(history.z0), even(history.z1)


ASYMMETRIC_STIFFNESS = AsymmetricStiffness(
    "asymmetric_stiffness", "oddness", "even in the torque", "elastic deflection of two flanks", "rad"
)


class UnequalDeflection(AngleEffect):
    """All that one flank turns, its clearance and its friction too, is larger than what the other does: an angle that is even in
    the angle which both turn alike, smooth in the root of its size."""

    instead = True

    def present(self, context):
        """Two per cent of the angle scale."""
        return USUAL

    def columns(self, angle):
        """Even integrals of the angle."""
        return even(angle)


UNEQUAL_DEFLECTION = UnequalDeflection("unequal_deflection", "oddness", "even in the angle", "as for the stiffness", "rad")


class UnequalFlanks(FlankEffect):
    """Elasticity, friction and clearance each differ between the flanks by a share of themselves."""

    def present(self, context):
        """Five per cent."""
        return 0.05


UNEQUAL_FLANKS = UnequalFlanks("unequal_flanks", "oddness", "even in the torque, with hysteresis", "as for the stiffness", "1")
