"""Loops that were not measured: of another amplitude or rate than a record's, out of the model and the model error."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.indicators.indicators import peak_angle_rad
from backdrive_bayes.indicators.loop import Loops, discrepancy_loops, model_loops, record_amplitude_nm, torque_grid
from backdrive_bayes.inference.fit import Posterior


class OtherLoops:
    """What one record tells of loops of other amplitudes and rates, for the draws ``picked`` out of the flat list."""

    def __init__(self, posterior: Posterior, record: int, picked):
        self.posterior, self.record = posterior, record
        self.z, self.weights = posterior.z[picked], posterior.weights[picked]
        self.amplitude_nm = record_amplitude_nm(posterior.problem, record)
        if posterior.discrepancy.present:
            self.peak = peak_angle_rad(model_loops(posterior.problem, self.z, record, torque_grid(self.amplitude_nm)))

    def of(self, amplitude_nm: float, exact=(), rate_nm_per_s: float | None = None) -> Loops:
        """Settled loops of that amplitude, whose torques hold ±``exact``, at that rate (default: the record's own).

        The model error is that of the measured loop, stretched to the other one in torque and, with the peak, in angle.
        """
        problem, own = self.posterior.problem, self.record
        loops = model_loops(problem, self.z, own, torque_grid(amplitude_nm, exact), rate_nm_per_s)
        if not self.posterior.discrepancy.present:
            return loops
        torque = loops.torque_nm * self.amplitude_nm / amplitude_nm
        error = discrepancy_loops(problem, self.posterior.discrepancy, self.weights, own, torque)
        share = (peak_angle_rad(loops) / self.peak)[:, None]
        return loops + Loops(loops.torque_nm, error.rising * share, error.falling * share)


def some_draws(posterior: Posterior, most: int) -> np.ndarray:
    """Numbers of at most ``most`` draws, evenly out of the flat list."""
    return np.linspace(0, len(posterior.z) - 1, min(most, len(posterior.z))).astype(int)
