"""Model discrepancy: a process along each leg of each record, which no listed effect explains."""

import numpy as np

from backdrive_bayes.mechanics.effect import PathEffect
from backdrive_bayes.mechanics.history import played

NODES = 10
ROUNDING = 1e-9
"""Torque by which the last digits of a torque at rest go back and end no leg."""


class Unexplained(PathEffect):
    """Hat functions along each monotone leg, independent between legs."""

    def present(self, context):
        """Six thousandths of the angle scale."""
        return 6e-3

    def responses(self, history, record, context):
        """Hats over the torque of each leg."""
        leg, found = _legs(history.z0[0], history.z1), []
        for z in (history.z0, history.z1):
            columns = np.zeros((z.size, (leg[-1] + 1) * NODES))
            for k in range(leg[-1] + 1):
                own = np.flatnonzero(leg == k)
                first, last = history.z0[own[0]], history.z1[own[-1]]
                share = (z[own] - first) / (last - first) if last != first else np.zeros(own.size)
                hats = np.maximum(0.0, 1.0 - np.abs(share[:, None] - np.linspace(0, 1, NODES)) * (NODES - 1))
                columns[own, k * NODES : (k + 1) * NODES] = hats
            found.append(columns)
        return tuple(found)


def _legs(first, z1) -> np.ndarray:
    """Number of the leg of each segment, (segments,); the torque may rest within one."""
    moved = np.diff(played(first, z1, ROUNDING))
    moving = np.flatnonzero(moved)
    turns = moving[1:][moved[moving[1:]] * moved[moving[:-1]] < 0]
    return np.searchsorted(turns, np.arange(z1.size), side="right")


UNEXPLAINED = Unexplained(
    "unknown", "repeatability", "differs from leg to leg", "Gaussian process along each leg", "rad", False, True
)
