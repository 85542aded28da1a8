"""Indicators of the reducer's own settled loop, and its angle on minor loops, from the mechanics and without noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.plan import Path
from backdrive_bayes.bench.protocol import Circumstances, Mechanics

K = 0.03
LEVELS = 4001
HELD_TURNS = (0.0, 0.9, 0.3, 0.7, -0.5, 0.2, -0.9, -0.1, -0.6, 0.8, 0.0)
"""Turning torques of the held-out minor loops, as shares of the rated torque."""
HELD_SAMPLES = 841


@dataclass(frozen=True, eq=False)
class HeldRecord:
    """Minor loops from rest at a rate that no record has; arrays of shape (HELD_SAMPLES,), without noise or channel effects.

    ``without_rad`` is the angle of the same reducer without planted effects.
    """

    rate_nm_per_s: float
    time_s: np.ndarray
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    without_rad: np.ndarray


def own_loop(mechanics: Mechanics, reducer, effects, where: Circumstances, amplitude_nm: float) -> dict[str, float]:
    """Indicators [rad, J, 1] of the loop of this amplitude [N·m] and the record's rate.

    Only effects of the reducer itself act. Definitions as in the contract: width at zero torque, lost motion at ±0.03 T_r (NaN
    where the loop does not reach that), half the peak-to-peak angle, enclosed area, signed work of loading, and area over work.
    """
    rate = where.path.rate_nm_per_s
    turns = amplitude_nm * np.array([0.0, 1, -1, 1, -1, 1])
    corner = np.r_[0.0, np.cumsum(np.abs(np.diff(turns)))] / rate
    at = Circumstances(Path(corner, turns, rate), where.start_s, where.index)
    levels = np.linspace(-amplitude_nm, amplitude_nm, LEVELS)
    times = corner[3] + np.r_[levels - levels[0], levels[1:] - levels[0] + 2.0 * amplitude_nm] / rate
    angle = mechanics.angle(reducer, own_effects(effects), at, np.minimum(times, corner[5]))
    return _indicators(levels, angle[LEVELS - 1 :], angle[:LEVELS][::-1], K * reducer.rated_torque_nm)


def held_record(mechanics: Mechanics, reducer, effects, planted, rate_nm_per_s: float, start_s: float) -> HeldRecord:
    """Minor loops at this rate; ``effects`` act, ``planted`` are those of them that are left out of ``without_rad``."""
    turns = reducer.rated_torque_nm * np.array(HELD_TURNS)
    corner = np.r_[0.0, np.cumsum(np.abs(np.diff(turns)))] / rate_nm_per_s
    where = Circumstances(Path(corner, turns, rate_nm_per_s), start_s)
    time = np.linspace(0.0, corner[-1], HELD_SAMPLES)
    rest = tuple(e for e in effects if not any(e is p for p in planted))
    angle, without = (mechanics.angle(reducer, own_effects(some), where, time) for some in (effects, rest))
    return HeldRecord(rate_nm_per_s, time, where.path.torque_at(time), angle, without)


def own_effects(effects):
    """Those of the effects that belong to the reducer and not to the measuring channel."""
    return tuple(e for e in effects if e.of_reducer)


def _indicators(torque, rising, falling, small_nm):
    middle, width = 0.5 * (rising + falling), falling - rising
    area = float(np.sum(0.5 * (width[1:] + width[:-1]) * np.diff(torque)))
    upper, lower = torque >= 0, torque <= 0
    work = _work(torque[upper], rising[upper]) - _work(torque[lower], falling[lower])
    lost = float(np.diff(np.interp([-small_nm, small_nm], torque, middle))[0])
    return {
        "lost_motion_rad": lost if small_nm <= torque[-1] else float("nan"),
        "zero_torque_width_rad": float(np.interp(0.0, torque, width)),
        "peak_angle_rad": float(0.5 * (rising[-1] - rising[0])),
        "loop_area_J": area,
        "absorbed_J": work,
        "dissipation_ratio": area / work,
    }


def _work(torque, angle):
    return float(np.sum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle)))
