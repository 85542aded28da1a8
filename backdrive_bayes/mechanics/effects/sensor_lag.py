"""The angle channel is late against the torque channel."""

import numba
import numpy as np

from backdrive_bayes.mechanics.effect import SpreadEffect, TangentEffect

SHORT = 1e-4
"""Segment, in shares of the lag, along which its output hardly moves."""


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
def behind(mean, end, t0, t1, lag_s):
    """Mean on every segment (segments,) of the output of a first-order lag of ``lag_s`` [s] whose input has these means and, at
    the segments' ends, these values [any unit], a parabola between; it has caught up with the first. Times are in seconds."""
    out = np.empty(mean.size)
    x = y = end[0]
    for i in range(mean.size):
        span = (t1[i] - t0[i]) / lag_s
        if span < SHORT:
            out[i] = y
            y += span * (mean[i] - y)
        else:
            bend = -6.0 * (mean[i] - 0.5 * (x + end[i])) / span
            slope = (end[i] - x) / span - bend
            steady = x - slope + 2.0 * bend / span
            new = end[i] - slope - 2.0 * bend + 2.0 * bend / span + (y - steady) * np.exp(-span)
            out[i] = mean[i] - (new - y) / span
            y = new
        x = end[i]
    return out
