"""An angle channel that is late against the torque channel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter, lfilter_zi

from backdrive_bayes.bench.effect import Effect


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
        constant = self.strength * (1.0 - self.delay_share)
        if constant == 0.0:
            return late
        ratio = 2.0 * constant / (run.time_s[1] - run.time_s[0])
        numerator, denominator = [1.0 / (1.0 + ratio)] * 2, [1.0, (1.0 - ratio) / (1.0 + ratio)]
        at_rest = late[0] * lfilter_zi(numerator, denominator)
        return lfilter(numerator, denominator, late, zi=at_rest)[0]


def draw(rng, reducer):
    """A delay, a filter, or half of each."""
    return SensorLag(0.0, float(rng.choice([0.0, 0.5, 1.0])))
