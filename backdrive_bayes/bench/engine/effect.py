"""What an effect can touch on the engine bench, in the order in which it acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.engine.clock import Steps
from backdrive_bayes.bench.engine.reducer import EngineReducer
from backdrive_bayes.bench.engine.train import Train
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances


@dataclass(frozen=True, eq=False)
class Run:
    """One record on the engine's steps: the reducer, its circumstances and the steps of the commanded torque."""

    reducer: EngineReducer
    where: Circumstances
    steps: Steps

    @property
    def relative_rate(self) -> float:
        """Loading rate in rated torques per second."""
        return self.where.path.rate_nm_per_s / self.reducer.rated_torque_nm


@dataclass(frozen=True)
class EngineEffect(BenchEffect):
    """An effect of the engine bench; final classes override the places where they act."""

    def load(self, run: Run, load):
        """Torque that acts on the output over T_r, shape (steps,)."""
        return load

    def train(self, run: Run, train: Train) -> Train:
        """The train as this effect changes it."""
        return train

    def series(self, run: Run, load):
        """Angle [rad] of a part in series with the output, shape (steps,) or 0."""
        return 0.0

    def transmit(self, run: Run, angle_rad):
        """Angle [rad] on the engine's steps after parts that remember, shape (steps,)."""
        return angle_rad

    def read(self, run: Run, time_s: np.ndarray, angle_rad):
        """Angle [rad] as read at times [s], pointwise, shape (samples,)."""
        return angle_rad
