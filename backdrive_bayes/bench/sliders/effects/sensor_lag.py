"""An angle channel that is late against the torque channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class SensorLag(Effect):
    """Pure delay, first-order filter, or both; strength is the lag in seconds, ``delay_share`` of it pure delay."""

    delay_share: float

    guess = 0.02
    most = 0.5
    of_reducer = False

    def read(self, run, angle_rad):
        """Late angle [rad]."""
        late = np.interp(run.time_s - self.strength * self.delay_share, run.time_s, angle_rad)
        return elements.relaxed(run.time_s, late, self.strength * (1.0 - self.delay_share))


def draw(rng, reducer):
    """A delay, a filter, or half of each."""
    return SensorLag(0.0, float(rng.choice([0.0, 0.5, 1.0])))
