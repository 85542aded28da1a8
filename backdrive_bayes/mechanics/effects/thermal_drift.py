"""Slow drift of the angle reading."""

import numpy as np
from numpy.polynomial.legendre import legval

from backdrive_bayes.mechanics.effect import PathEffect

ORDERS = 5


class ThermalDrift(PathEffect):
    """Legendre polynomials of the time within a record, higher orders smaller."""

    def present(self, context):
        """A per cent of the angle scale."""
        return 0.01

    def responses(self, history, record, context):
        """Polynomials at the segments' ends."""
        first, last = history.t0[0], history.t1[-1]
        weights = np.diag(np.r_[0.0, 1.0 / np.arange(1, ORDERS + 1)])[:, 1:]
        return tuple(legval(2 * (t - first) / (last - first) - 1, weights).T for t in (history.t0, history.t1))


THERMAL_DRIFT = ThermalDrift(
    "thermal_drift", "time invariance", "depends on the time, not on the torque", "polynomial in time", "rad", False, True
)
