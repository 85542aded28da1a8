"""Read a torque history for prediction: time and torque without an angle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.optimize import isotonic_regression

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.clock import strictly_rising
from backdrive_bayes.records.columns import read_channels
from backdrive_bayes.records.turning import NOISE_MULTIPLE, zigzag
from backdrive_bayes.records.white_noise import white_noise

FEWEST_STAMPS = 100
"""Samples from which on a time stamp that comes twice is that of a coarse clock and no step."""
FEW_REVERSALS = 20
"""Reversals up to which a history is none that noise made."""
BINS_PER_LEG = 100
"""Means of a leg at most, of which the monotone torque is made."""
MOST_LEFT = 1.5
"""Root mean square of what may be taken out, in standard deviations of the noise."""


def read_history(path: Path) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Time [s] and torque [N·m], shape (samples,) each, and notes on what was guessed; BadInput names file, row and finding."""
    channels = read_channels(path, ("time", "torque"), {})
    time, torque = channels.values.values()
    if time.size < 2:
        raise BadInput(path, "a history of at least two samples", f"{time.size}")
    twice = np.flatnonzero(np.diff(time) == 0.0)
    if twice.size and time.size < FEWEST_STAMPS:
        row = f"{path}, row {channels.first_row + twice[0] + 1}, time"
        raise BadInput(row, "rising time stamps (a step of the torque takes some time)", f"{time[twice[0]]:.9g} s twice")
    time, clock = strictly_rising(time, channels.first_row, str(path))
    return time, torque, (*channels.notes, *clock)


def noise_free_torque(time_s, torque_nm) -> tuple[np.ndarray, bool]:
    """The torque without sensor noise, shape (samples,), and whether noise had to be taken out.

    A commanded history turns where it says so and is kept as it is; a measured one reverses at every few samples and would drive
    every hysteresis operator with its noise: it is made monotone between those turning points that no noise makes. Where this
    takes out more than the noise, what was taken for noise is the path itself.
    """
    steps, noise = np.diff(torque_nm), white_noise(torque_nm, time_s)
    reversals = np.count_nonzero(np.diff(np.sign(steps[steps != 0])))
    if reversals <= FEW_REVERSALS or NOISE_MULTIPLE * noise > 0.5 * np.ptp(torque_nm):
        return torque_nm, False
    smooth = np.empty_like(torque_nm)
    turns = [0, *zigzag(torque_nm.tolist(), NOISE_MULTIPLE * noise), torque_nm.size - 1]
    for start, stop in zip(turns[:-1], turns[1:], strict=True):
        part = torque_nm[start : stop + 1]
        edges = np.unique(np.linspace(0, part.size, min(BINS_PER_LEG, part.size) + 1).astype(int))
        count = np.diff(edges)
        mean = np.add.reduceat(part, edges[:-1]) / count
        direction = 1.0 if part[-1] >= part[0] else -1.0
        level = direction * isotonic_regression(direction * mean, weights=count).x
        smooth[start : stop + 1] = np.interp(np.arange(part.size), 0.5 * (edges[1:] + edges[:-1] - 1), level)
    left = float(np.sqrt(np.mean((smooth - torque_nm) ** 2)))
    return (smooth, True) if 0.0 < left < MOST_LEFT * noise else (torque_nm, False)

