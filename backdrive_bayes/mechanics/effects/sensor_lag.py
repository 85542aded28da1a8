"""The angle channel is late against the torque channel."""

import numba
import numpy as np

from backdrive_bayes.mechanics.effect import SpreadEffect, TangentEffect


class SensorLag(TangentEffect):
    """The loop's width grows with rate times slope: late is one way, an angle ahead of the torque is no lag."""

    one_way = True

    def present(self, context):
        """The torque moves by some thousandths of the largest at the fastest rate."""
        return 6e-3 / context.rate.max()


SENSOR_LAG = SensorLag(
    "sensor_lag",
    "rate independence",
    "width grows with rate times slope",
    "delay and first-order lag alike, to first order in the lag",
    "s",
    False,
    False,
    "lag_s",
)


class LagSpread(SpreadEffect):
    """How much of the lag is a first-order one: 0 for a pure delay, 1 where all of it smooths."""

    def present(self, context):
        """Half of it."""
        return 0.5


LAG_SPREAD = LagSpread(
    "lag_spread", "rate independence", "steps are rounded", "step response of a first-order lag", "1", False, False
)


@numba.njit(cache=True, nogil=True)
def behind(angle, t0, t1, lag_s):
    """Output of a first-order lag at both ends of every segment, two of (segments,), for an input that is ``angle`` (segments,)
    at the segments' ends [any unit] and straight between them; it has caught up with the first."""
    begin, end = np.empty(angle.size), np.empty(angle.size)
    x = y = angle[0]
    for i in range(angle.size):
        begin[i] = y
        span = (t1[i] - t0[i]) / lag_s
        if span > 0.0:
            slope = (angle[i] - x) / span
            y = angle[i] - slope + (y - x + slope) * np.exp(-span)
        x = angle[i]
        end[i] = y
    return begin, end
