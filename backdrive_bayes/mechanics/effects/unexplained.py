"""Model discrepancy: a process along each leg of each record, which no listed effect explains."""

import numpy as np

from backdrive_bayes.mechanics.effect import PathEffect

NODES = 10


class Unexplained(PathEffect):
    """Hat functions along each monotone leg, independent between legs."""

    def trace(self, context):
        """A hundredth of the angle noise."""
        return 0.01 * context.angle_noise

    def present(self, context):
        """Six thousandths of the angle scale."""
        return 6e-3

    def responses(self, history, record, context):
        """Hats over the torque of each leg."""
        direction = np.sign(history.z1 - history.z0)
        leg = np.r_[0, np.cumsum((direction[1:] * direction[:-1]) < 0)]
        found = []
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


UNEXPLAINED = Unexplained(
    "unknown", "repeatability", "differs from leg to leg", "Gaussian process along each leg", "rad", False, True
)
