"""Thermal drift: the angle reading drifts slowly with time, whatever the torque does."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Normal, Parameter

WARM_UP = "weakly informative: some per cent of the peak angle over a record"


class ThermalDrift:
    """A cubic in time over each record (Legendre polynomials of degree 1 to 3)."""

    name = "thermal_drift"
    stage = Stage.ANGLE_CHANNEL
    signature = "depends on time and not on torque: the loop does not close, record by record"
    source = "warm-up of encoders, mounts and housings"
    parameters = (
        Parameter("drift", "rad", "angle", Normal(0.02), 0.0, WARM_UP, True),
        Parameter("drift_bend", "rad", "angle", Normal(0.008), 0.0, WARM_UP, True),
        Parameter("drift_twist", "rad", "angle", Normal(0.004), 0.0, WARM_UP, True),
    )

    def respond(self, values, drive):
        """What the drift adds to the reading [rad], shape (…, samples)."""
        time = drive.path.time_s
        t = 2 * (time - time[0]) / max(np.ptp(time), 1e-300) - 1
        return values["drift"] * t + values["drift_bend"] * 0.5 * (3 * t**2 - 1) + values["drift_twist"] * 0.5 * (5 * t**3 - 3 * t)
