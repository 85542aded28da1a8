"""Thermal drift: the angle reading drifts slowly with time, whatever the torque does."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.legendre import legvander

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Normal, Parameter

WARM_UP = "weakly informative: some per cent of the peak angle over a record"


TERMS = {"drift": 0.02, "drift_bend": 0.008, "drift_twist": 0.004, "drift_wave": 0.002, "drift_ripple": 0.001}
"""Legendre coefficients of degree 1 to 5 and their prior standard deviations in the angle scale."""


class ThermalDrift:
    """A polynomial of degree five in time over each record, smooth enough for a warm-up and its end."""

    name = "thermal_drift"
    stage = Stage.ANGLE_CHANNEL
    of_time = True
    signature = "depends on time and not on torque: the loop does not close, record by record"
    source = "warm-up of encoders, mounts and housings"
    parameters = tuple(Parameter(name, "rad", "angle", Normal(sd), 0.0, WARM_UP, True) for name, sd in TERMS.items())

    def respond(self, values, drive):
        """What the drift adds to the reading [rad], shape (…, samples)."""
        time = drive.path.time_s
        basis = legvander(2 * (time - time[0]) / max(np.ptp(time), 1e-300) - 1, len(TERMS))
        return np.concatenate([values[name] for name in TERMS], axis=-1) @ basis[:, 1:].T
