"""Read a torque history for prediction: time and torque without an angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import isotonic_regression

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.clock import strictly_rising
from backdrive_bayes.records.columns import read_channels

NOISY_SHARE = 0.02
BINS_PER_SEGMENT = 100


def read_history(path: Path) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Time [s] and torque [N·m], shape (samples,) each, and notes on what was guessed; BadInput names file, row and finding."""
    channels = read_channels(path, ("time", "torque"), {})
    time, torque = channels.values.values()
    if time.size < 2:
        raise BadInput(path, "a history of at least two samples", f"{time.size}")
    time, clock = strictly_rising(time, channels.first_row, str(path))
    return time, torque, (*channels.notes, *clock)


def noise_free_torque(time_s, torque_nm) -> tuple[np.ndarray, bool]:
    """The torque without sensor noise, shape (samples,), and whether noise had to be taken out.

    A commanded history reverses rarely and is kept as it is; a measured one reverses at every few samples and would drive
    every hysteresis operator with its noise: it is made monotone between its turning points.
    """
    steps = np.diff(torque_nm)
    reversals = np.count_nonzero(np.diff(np.sign(steps[steps != 0])))
    if reversals <= max(20, NOISY_SHARE * torque_nm.size):
        return torque_nm, False
    smooth = np.empty_like(torque_nm)
    for s in find_segments(time_s, torque_nm):
        part = torque_nm[s.start : s.stop]
        edges = np.unique(np.linspace(0, part.size, min(BINS_PER_SEGMENT, part.size) + 1).astype(int))
        count = np.diff(edges)
        mean = np.add.reduceat(part, edges[:-1]) / count
        level = s.direction * isotonic_regression(s.direction * mean, weights=count).x
        smooth[s.start : s.stop] = np.interp(np.arange(part.size), 0.5 * (edges[1:] + edges[:-1] - 1), level)
    return smooth, True
