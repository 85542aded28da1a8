"""The engine's clock: at which torques and times of a path the engine steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.plan import Path

STEPS_PER_RATED = 800.0
STEPS_NEAR_ZERO = 5000.0
_NEAR = 0.12
_HOLD_STEPS = 1500
_LEVELS = np.linspace(-3.0, 3.0, 12001)
"""Torques over T_r on which the density of steps is tabulated."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Times [s], commanded torque over T_r and durations [s] of the engine's steps, shape (steps,) each."""

    time_s: np.ndarray
    load: np.ndarray
    step_s: np.ndarray


def make_steps(path: Path, rated_torque_nm: float, refine: float = 1.0) -> Steps:
    """Steps along a path, even in torque and denser near zero, where clearances are crossed; ``refine`` multiplies them."""
    load, time = path.torque_nm / rated_torque_nm, path.time_s
    count = np.interp(load, _LEVELS, _table()) * refine
    gone, lasting = np.diff(count), np.diff(time)
    pieces = np.maximum(np.ceil(np.abs(gone)), np.ceil(_HOLD_STEPS * lasting / max(np.sum(lasting), 1e-300)))
    pieces = np.maximum(pieces, 1).astype(int)
    leg = np.repeat(np.arange(pieces.size), pieces)
    share = (np.arange(leg.size) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 1.0) / pieces[leg]
    at = np.interp(count[leg] / refine + share * gone[leg] / refine, _table(), _LEVELS)
    change = np.diff(load)[leg]
    passed = np.where(change == 0.0, share, (at - load[leg]) / np.where(change == 0.0, 1.0, change))
    passed = np.where(share == 1.0, 1.0, np.clip(passed, 0.0, 1.0))
    times = np.r_[time[0], time[leg] + passed * lasting[leg]]
    loads = np.r_[load[0], load[leg] + passed * change]
    return Steps(times, loads, np.maximum(np.diff(times, prepend=times[0] - 1e-3), 1e-9))


def _table():
    """Steps from torque 0 to each level."""
    density = STEPS_PER_RATED + STEPS_NEAR_ZERO / (1.0 + (_LEVELS / _NEAR) ** 4)
    steps = np.r_[0.0, np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(_LEVELS))]
    return steps - steps[_LEVELS.size // 2]
