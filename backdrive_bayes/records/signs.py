"""The physics every loop obeys: the angle grows with the torque, a cycle takes energy in, an encoder turns little per sample."""

from __future__ import annotations

import math

import numpy as np

from backdrive_bayes.records.faults import SPOILING_SHARE, find_wild, gaps_after
from backdrive_bayes.records.measured_loop import MeasuredLoop
from backdrive_bayes.records.wraps import find_jumps

_LONG = 0.5  # of the longest ramp: shorter ones say little of the slope
_END_SHARE = 0.1  # of a ramp's samples at either end
_SURE_SD = 4.0
_BREAK_STEPS = 20.0  # of the usual ones, of a torque that breaks off: the steps of a noisy one are a few
_REVERSED = 0.2  # of half the angle between the tips: waves of an encoder and drifts stay below


def angle_rise(torque_nm: np.ndarray, angle_rad: np.ndarray, segments, noise) -> dict:
    """By how much the angle grows over a full ramp of rising torque [rad], and the standard error of that from noise.

    The mean over rising ramps and that over falling ones count alike, so that a drift cancels.
    """
    reach = [float(np.ptp(torque_nm[s.start : s.stop])) for s in segments]
    rises: dict[int, list[float]] = {1: [], -1: []}
    for segment, span in zip(segments, reach, strict=True):
        count = max(int(_END_SHARE * (segment.stop - segment.start)), 1)
        if span >= _LONG * max(reach):
            end = np.mean(angle_rad[segment.stop - count : segment.stop]) - np.mean(angle_rad[segment.start :][:count])
            rises[segment.direction].append(segment.direction * float(end))
    sides = [float(np.mean(side)) for side in rises.values() if side]
    sd = math.hypot(noise.correlated_rad, noise.white_rad / math.sqrt(count)) / math.sqrt(len(sides))
    return {"rise_rad": float(np.mean(sides)), "largest_side_rad": max(sides), "sd_rad": sd, "sides": len(sides)}


def angle_jumps(angle_rad: np.ndarray, segments) -> dict:
    """Steps between samples that no loaded shaft makes: how many, how many of them against the motion, sizes [rad]."""
    wild = find_wild(angle_rad)
    steps = np.where(wild[1:] | wild[:-1], 0.0, np.diff(angle_rad))
    jumps = find_jumps(angle_rad)
    direction = _directions(segments)
    return {
        "count": int(jumps.size),
        "against_motion": int(np.count_nonzero(np.sign(steps[jumps]) * direction[jumps] < 0)),
        "size_rad": float(np.median(np.abs(steps[jumps]))) if jumps.size else 0.0,
        "first_sample": int(jumps[0]) + 2 if jumps.size else None,
        "largest_step_rad": float(np.abs(steps).max()),
    }


def _directions(segments) -> np.ndarray:
    """Way of the ramp at every sample, 1 or -1, (samples,)."""
    return np.concatenate([np.full(s.stop - s.start, s.direction) for s in segments])


def torque_breaks(time_s: np.ndarray, torque_nm: np.ndarray, segments) -> np.ndarray:
    """Numbers of the samples before which the torque jumps against its ramp, far from the ramp's ends: a cable that was loose for
    a while takes it away and gives it back, one of which is against any ramp."""
    steps, inner = np.diff(torque_nm), np.zeros(len(torque_nm) - 1, bool)
    direction = _directions(segments)[1:]
    for segment in segments:
        end = max(int(_END_SHARE * (segment.stop - segment.start)), 1)
        inner[segment.start + end : segment.stop - end] = True
    inner[gaps_after(time_s)] = False
    far = max(SPOILING_SHARE * float(np.ptp(torque_nm)), _BREAK_STEPS * float(np.median(np.abs(steps))))
    return 1 + np.flatnonzero(inner & (steps * direction < -far))


def inverted(rise: dict, angle_range_rad: float) -> bool:
    """Whether the angle falls where the torque rises, on rising and on falling ramps alike and beyond doubt."""
    return rise["largest_side_rad"] < -max(_SURE_SD * rise["sd_rad"], 0.05 * angle_range_rad)


def not_answering(rise: dict, angle_range_rad: float) -> bool:
    """Whether rising and falling ramps together do not raise the angle, although it moves."""
    return rise["rise_rad"] <= max(_SURE_SD * rise["sd_rad"], 0.02 * angle_range_rad) and not inverted(rise, angle_range_rad)


def width_reversed(loop: MeasuredLoop | None, rise: dict) -> bool:
    """Whether at zero torque the measured cycle is passed the wrong way beyond noise, by more than waves and drifts make: no
    reducer turns further before it was loaded than after."""
    if loop is None or loop.zero_torque_width_rad is None or rise["rise_rad"] <= 0.0:
        return False
    sd = loop.zero_torque_width_rad_sd or 0.0
    return loop.zero_torque_width_rad < -max(_SURE_SD * sd, _REVERSED * abs(loop.half_peak_to_peak_rad))


def gives_energy(loop: MeasuredLoop | None, rise: dict) -> bool:
    """Whether the measured cycle gives energy back beyond noise, although the angle grows with the torque."""
    if loop is None or rise["rise_rad"] <= 0.0:
        return False
    box = 4.0 * loop.amplitude_nm * abs(loop.half_peak_to_peak_rad)
    return loop.loop_area_j < -max(_SURE_SD * loop.loop_area_j_sd, 0.01 * box)
