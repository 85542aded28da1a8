"""Delayed compliance of polymer gears."""

import numba
import numpy as np
from scipy.linalg import block_diag

from backdrive_bayes.mechanics.effect import PathEffect
from backdrive_bayes.mechanics.history import lagged, played

TIMES = 8
ALIKE, ALIKE_BEFORE = 1.5, 6.0
"""Distances in ln of the time constant over which elements are alike, and over which their states at a record's beginning are."""
FRICTION = 0.04
"""Threshold of the play through which some of the columns see the torque: creep behind friction."""
BEFORE = 0.2
"""Standard deviation of a state at the beginning of a record, in that of an element's angle at the largest torque: the state is
not tied to the element's own angle, or the model would not be linear."""


class ViscoelasticCreep(PathEffect):
    """Kelvin-Voigt elements over a range of time constants, driven by the torque, by the torque behind friction and, as creep
    that grows faster than the load (Schapery, Polym. Eng. Sci. 9, 1969), by its square; and in each record by itself what is left
    of the load before it."""

    def present(self, context):
        """Three per cent of the angle scale."""
        return 0.03

    def times_s(self, context) -> np.ndarray:
        """Time constants [s], from a thirtieth of the shortest record to half of the longest."""
        return np.geomspace(0.03 * context.duration_s.min(), 0.5 * context.duration_s.max(), TIMES)

    def responses(self, history, record, context):
        """Delayed less instantaneous response at the segments' ends."""
        times = self.times_s(context)
        span = np.maximum(history.t1 - history.t0, 1e-12)
        held = played(history.z0[0], history.z1, FRICTION)
        begin, end = [], []
        bent = tuple(z * np.abs(z) for z in (history.z0, history.z1))
        for (z0, z1), chosen in (((history.z0, history.z1), times), ((held[:-1], held[1:]), times[::2]), (bent, times[::2])):
            for time in chosen:
                a, b = _delayed(z0, z1, span, time)
                begin.append(a - z0)
                end.append(b - z1)
        mixing, before = _mixing(np.log(times))
        found = []
        for columns, at in ((begin, history.t0), (end, history.t1)):
            left = np.zeros((at.size, context.rate.size, times[::2].size))
            if record is not None:
                left[:, record] = np.exp((history.t0[0] - at)[:, None] / times[::2]) @ before
            found.append(np.hstack([np.stack(columns, axis=1) @ mixing, left.reshape(at.size, -1)]))
        return found[0], found[1]


def _mixing(log_times):
    """Roots of the prior covariance of all elements that are driven by the record's own load, and of their states at its
    beginning: the same earlier load drove elements of all times, so that these are more alike."""
    apart = np.abs(log_times[:, None] - log_times)
    near, left = np.exp(-apart / ALIKE), BEFORE**2 * np.exp(-apart[::2, ::2] / ALIKE_BEFORE)
    fewer = np.linalg.cholesky(0.5 * near[::2, ::2])
    return block_diag(np.linalg.cholesky(near), fewer, fewer), np.linalg.cholesky(left)


@numba.njit(cache=True, nogil=True)
def _delayed(z0, z1, span, time):
    """Response of a Kelvin-Voigt element at the segments' ends, exact for straight segments, at rest before the first."""
    begin, end = np.empty(z0.size), np.empty(z0.size)
    x = z0[0]
    for i in range(z0.size):
        begin[i] = x
        x = lagged(x, z0[i], z1[i], 0.0, span[i] / time)
        end[i] = x
    return begin, end


VISCOELASTIC_CREEP = ViscoelasticCreep(
    "viscoelastic_creep",
    "rate independence",
    "relaxes with time constants of seconds",
    "Ferry, Viscoelastic Properties of Polymers, 1980, ch. 3",
    "rad",
)
