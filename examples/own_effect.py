"""An effect of one's own: columns whose weights are wide where it acts, diagnosed like the package's own.

In a package of yours, register it in pyproject.toml:

    [project.entry-points."backdrive_bayes.effects"]
    loose_plate = "my_package.loose_plate:LOOSE_PLATE"
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.mechanics.effect import Context, PathEffect
from backdrive_bayes.mechanics.history import through

SEATED = (0.02, 0.05, 0.12)
"""Torques at which the plate may seat, as shares of the largest torque."""


class LoosePlate(PathEffect):
    """A plate that yields under one sign of the torque only and then seats."""

    def present(self, context):
        """Two per cent of the angle scale."""
        return 0.02

    def responses(self, history, record, context):
        """Its columns at the beginning and the end of every segment, (segments, columns) each."""
        return tuple(np.tanh(np.maximum(z, 0.0)[:, None] / SEATED) for z in (history.z0, history.z1))


LOOSE_PLATE = LoosePlate("loose_plate", "oddness", "a step of the angle under one sign of the torque", "this example", "rad")


def main():
    """Show what the effect adds to a loop."""
    time = np.linspace(0.0, 3.0, 301)
    history = through(time, 0.1 * np.interp(time, [0.0, 1.0, 2.0, 3.0], [0.0, 1.0, -1.0, 1.0]), 0.1)
    context = Context(0.1, 0.02, np.array([1.0]), np.array([3.0]), 0.003, 0.001)
    angle = LOOSE_PLATE.responses(history, 0, context)[1] @ np.array([0.0, 0.05, 0.0]) * context.angle_scale_rad
    print(f"{LOOSE_PLATE.name}: {1e3 * angle.min():.2f} to {1e3 * angle.max():.2f} mrad")


if __name__ == "__main__":
    main()
