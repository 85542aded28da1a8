"""Delayed compliance of polymer gears."""

import numba
import numpy as np
from scipy.linalg import block_diag

from backdrive_bayes.mechanics.effect import PathEffect
from backdrive_bayes.mechanics.history import played

TIMES = 8
FRICTION = 0.04
"""Threshold of the play through which half of the columns see the torque: creep behind friction."""
BEFORE = 0.2
"""Standard deviation of an element's state at the beginning of a record, in shares of its angle at the largest torque."""


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
        for own in range(context.rate.size):
            for time in times[::2]:
                begin.append((own == record) * np.exp((history.t0[0] - history.t0) / time))
                end.append((own == record) * np.exp((history.t0[0] - history.t1) / time))
        mixing = _mixing(np.log(times), context.rate.size)
        return np.stack(begin, axis=1) @ mixing, np.stack(end, axis=1) @ mixing


def _mixing(log_times, records):
    near = np.exp(-np.abs(log_times[:, None] - log_times) / 1.5)
    fewer = np.linalg.cholesky(0.5 * near[::2, ::2])
    # One load came before all of them.
    before = np.linalg.cholesky(BEFORE**2 * near[::2, ::2] ** 0.25)
    return block_diag(np.linalg.cholesky(near), fewer, fewer, *[before] * records)


@numba.njit(cache=True, nogil=True)
def _delayed(z0, z1, span, time):
    """Response of a Kelvin-Voigt element at the segments' ends, exact for straight segments, at rest before the first."""
    begin, end = np.empty(z0.size), np.empty(z0.size)
    x = z0[0]
    for i in range(z0.size):
        begin[i] = x
        slope = (z1[i] - z0[i]) / span[i]
        x = z1[i] - slope * time + (x - z0[i] + slope * time) * np.exp(-span[i] / time)
        end[i] = x
    return begin, end


VISCOELASTIC_CREEP = ViscoelasticCreep(
    "viscoelastic_creep",
    "rate independence",
    "relaxes with time constants of seconds",
    "Ferry, Viscoelastic Properties of Polymers, 1980, ch. 3",
    "rad",
)
