"""Absolute encoders that start anew after a full turn: unwrapped where the turn is certain, left alone where it is not."""

from __future__ import annotations

import math

import numpy as np

TURN_RAD = math.tau
LARGEST_STEP_RAD = 0.25 * TURN_RAD
"""No encoder on a loaded output turns further between two samples."""
_NEAR_TURN = 0.1  # a jump within this share of a full turn is one
_BRIEF_SAMPLES = 3
_SAME = 0.02  # jumps of one modulus agree to this share
_SNAP, _MOST_PARTS = 0.003, 24  # of a turn: an encoder may repeat every half, third, … of it
_FOLLOWS = 0.3  # correlation from which an angle follows the torque
_JUMP_SHARE = 0.5  # of the channel's range
_JUMP_TIMES = 20.0  # times the usual step


def unwrapped(torque_nm: np.ndarray, angle_rad: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    """The angle without wraps, and notes; arrays of shape (samples,), jumps of an unclear size are left in.

    A jump is a wrap where it is near a full turn, or where all jumps have one size, go both ways in balance, and taking them
    out turns an angle that did not follow the torque into one that does.
    """
    jumps = find_jumps(angle_rad)
    if not jumps.size:
        return angle_rad, ()
    size = np.abs(np.diff(angle_rad)[jumps])
    if _near_turns(size):
        period, what = TURN_RAD, "a full turn"
    elif _is_modulus(torque_nm, angle_rad, jumps, size):
        period = _modulus(angle_rad, jumps)
        what = f"a constant {math.degrees(period):.5g}°"
    else:
        return angle_rad, ()
    note = f"the angle wraps: {jumps.size} jump{'s'[: jumps.size != 1]} of {what} taken out"
    return _taken_out(angle_rad, jumps, period), (note,)


def find_jumps(angle_rad: np.ndarray) -> np.ndarray:
    """Indices before the steps that are far larger than the usual one and span half of the range.

    None where all come back within a few samples: those are drop-outs or spikes, unless they are full turns.
    """
    steps = np.abs(np.diff(angle_rad))
    least = max(_JUMP_SHARE * float(np.ptp(angle_rad)), _JUMP_TIMES * float(np.median(steps)))
    jumps = np.flatnonzero(steps > least)
    if not jumps.size or _near_turns(steps[jumps]):
        return jumps
    lasting = np.r_[jumps[1:], len(angle_rad)] - jumps > _BRIEF_SAMPLES
    spikes = jumps.size % 2 == 0 and not lasting[::2].any()
    return jumps[:0] if spikes else jumps


def _near_turns(sizes: np.ndarray) -> bool:
    return bool(np.all(np.abs(sizes - TURN_RAD) < _NEAR_TURN * TURN_RAD))


def _taken_out(angle: np.ndarray, jumps: np.ndarray, period: float) -> np.ndarray:
    turns = np.zeros(len(angle))
    turns[jumps + 1] = -np.sign(np.diff(angle)[jumps])
    return angle + period * np.cumsum(turns)


def _modulus(angle: np.ndarray, jumps: np.ndarray) -> float:
    """The size of the wraps [rad]: a whole fraction of a turn where it is near one, what joins the two sides else."""
    steps = np.diff(angle)
    inner = jumps[(jumps > 0) & (jumps < len(steps) - 1)]
    alone = inner[~(np.isin(inner - 1, jumps) | np.isin(inner + 1, jumps))]
    if not alone.size:
        return float(np.median(np.abs(steps[jumps])))
    size = float(np.median(np.abs(steps[alone] - 0.5 * (steps[alone - 1] + steps[alone + 1]))))
    parts = max(1, round(TURN_RAD / size))
    known = TURN_RAD / parts
    return known if parts <= _MOST_PARTS and abs(known - size) < _SNAP * size else size


def _is_modulus(torque, angle, jumps, size) -> bool:
    signs = np.sign(np.diff(angle)[jumps])
    if jumps.size < 2 or abs(signs.sum()) > 1 or np.ptp(size) > _SAME * size.mean():
        return False
    straight = _taken_out(angle, jumps, float(size.mean()))
    # A wrap jumps against the motion; the cliff of a clearance that is crossed between two samples jumps with it.
    before, after = (float(np.corrcoef(torque, channel)[0, 1]) for channel in (angle, straight))
    return abs(after) > _FOLLOWS and np.sign(after) * before < _FOLLOWS
