"""Indicators of the reducer's own settled loop, from the mechanics and without noise."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.bench.effect import Run
from backdrive_bayes.bench.mechanics import Setting, reducer_angle
from backdrive_bayes.bench.plan import Path, event_grid

K = 0.03
STEPS_PER_LEG = 700


def own_loop(reducer, effects, setting: Setting, amplitude_nm: float) -> dict[str, float]:
    """Indicators [rad, J, 1] of the loop of this amplitude [N·m] and the record's rate.

    Only effects of the reducer itself act. Definitions as in the contract: width at zero torque, lost motion at ±0.03 T_r, half
    the peak-to-peak angle, enclosed area, signed work of loading, and area over work.
    """
    rate = setting.path.rate_nm_per_s
    torque = amplitude_nm * np.array([0.0, 1, -1, 1, -1, 1])
    time = np.r_[0.0, np.cumsum(np.abs(np.diff(torque)))] / rate
    path = Path(time, torque, rate)
    grid = event_grid(path, reducer.rated_torque_nm, STEPS_PER_LEG)
    own = tuple(e for e in effects if e.of_reducer)
    run = Run(reducer, grid, path.torque_at(grid), rate, setting.start_s, setting.index)
    angle = reducer_angle(own, run)
    down = (grid >= time[3]) & (grid <= time[4])
    up = grid >= time[4]
    levels = np.linspace(-amplitude_nm, amplitude_nm, 4001)
    rising = np.interp(levels, run.torque_nm[up], angle[up])
    falling = np.interp(levels, run.torque_nm[down][::-1], angle[down][::-1])
    return _indicators(levels, rising, falling, K * reducer.rated_torque_nm)


def _indicators(torque, rising, falling, small_nm):
    middle, width = 0.5 * (rising + falling), falling - rising
    area = float(np.sum(0.5 * (width[1:] + width[:-1]) * np.diff(torque)))
    upper, lower = torque >= 0, torque <= 0
    work = _work(torque[upper], rising[upper]) - _work(torque[lower], falling[lower])
    return {
        "lost_motion_rad": float(np.diff(np.interp([-small_nm, small_nm], torque, middle))[0]),
        "zero_torque_width_rad": float(np.interp(0.0, torque, width)),
        "peak_angle_rad": float(0.5 * (rising[-1] - rising[0])),
        "loop_area_J": area,
        "absorbed_J": work,
        "dissipation_ratio": area / work,
    }


def _work(torque, angle):
    return float(np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle)))
