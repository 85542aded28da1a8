"""One part of the class of reducers: cells and the prior of their weights."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.mechanics.cells import Cells

TOP = 1.2
"""Torque up to which cells reach, in the unit's largest: an offset of the torque channel must not leave the class."""
SHARED = 0.97
"""Share of the variance that neighbouring thresholds of friction, or torques of clearance and free play, have in common."""


@dataclass(frozen=True, eq=False)
class Part:
    """One part of the class: its cells, and ``mixing`` (cells, cells) that turns independent weights into the prior's.

    ``log_scale`` is mean and standard deviation of the normal prior on the log standard deviation of the weights, in shares of
    the angle scale.
    """

    name: str
    module: str
    cells: Cells
    mixing: np.ndarray | None
    log_scale: tuple[float, float]

    def mix(self, responses: np.ndarray) -> np.ndarray:
        """Columns of independent weights from responses of the cells."""
        return responses if self.mixing is None else responses @ self.mixing

    def weights(self, independent: np.ndarray) -> np.ndarray:
        """Weights of the cells from independent ones, shape (cells, …)."""
        return independent if self.mixing is None else self.mixing @ independent


def below(torque, most: float):
    """Falls from one to nothing where a torque exceeds ``most``: friction and drag are small against the load."""
    return 1.0 / (1.0 + (torque / most) ** 4)


def apart(values):
    """Distances of values (n,) from one another, (n, n)."""
    return np.abs(values[:, None] - values)
