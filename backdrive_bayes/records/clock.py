"""Time stamps made strictly rising where a coarse clock repeats them."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from backdrive_bayes.errors import BadInput

_GAP_TICKS = 5  # a step of more clock ticks than this is a gap and is kept
_LINE_TICKS = 2.0  # stamps this close to a straight line of the index came from even sampling
_SMOOTH_TICKS = 30


def strictly_rising(time_s: np.ndarray, first_row: int, where: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return times (samples,) in s that rise strictly, with a note where stamps were coarse.

    Raises BadInput naming the row where time runs backwards or never moves.
    """
    steps = np.diff(time_s)
    back = np.flatnonzero(steps < 0.0)
    if back.size:
        row = back[0] + 1
        raise BadInput(f"{where}, row {first_row + row}, time", f"more than {time_s[row - 1]:.9g} s", f"{time_s[row]:.9g} s")
    shared = int(np.count_nonzero(steps == 0.0))
    if shared == 0:
        return time_s, ()
    if shared == len(steps):
        raise BadInput(f"{where}, time", "rising time stamps", f"{time_s[0]:.9g} s throughout")
    tick = float(np.median(steps[steps > 0.0]))
    retimed = _interpolated(time_s) if shared < 0.05 * len(steps) else _even(time_s, tick)
    if not np.all(np.diff(retimed) > 0.0):
        retimed = np.linspace(time_s[0], time_s[-1], len(time_s))
    note = f"coarse clock: {shared + 1} of {len(time_s)} samples share a stamp (step {tick:.3g} s); re-timed by index"
    return retimed, (note,)


def _even(time: np.ndarray, tick: float) -> np.ndarray:
    """Re-time the stretches between gaps, each by its index; sampling may drift slowly."""
    edges = [0, *(np.flatnonzero(np.diff(time) > _GAP_TICKS * tick) + 1), len(time)]
    period = (time[-1] - time[0]) / (len(time) - 1)
    pieces = [_stretch(time[start:stop], tick, period) for start, stop in zip(edges[:-1], edges[1:], strict=True)]
    return np.concatenate(pieces)


def _stretch(time: np.ndarray, tick: float, period: float) -> np.ndarray:
    index = np.arange(len(time), dtype=float)
    if time[-1] - time[0] < 3.0 * tick:
        return time[0] + min(period, tick / len(time)) * index
    line = np.polyval(np.polyfit(index, time - time[0], 1), index) + time[0]
    rest = time - line
    if np.abs(rest).max() <= _LINE_TICKS * tick:
        return line
    # the sampling rate drifted: follow the stamps' own trend, averaged over many ticks
    window = max(3, int(_SMOOTH_TICKS * tick * len(time) / (time[-1] - time[0])))
    return line + uniform_filter1d(uniform_filter1d(rest, window, mode="nearest"), window, mode="nearest")


def _interpolated(time: np.ndarray) -> np.ndarray:
    """Spread the few repeated stamps evenly up to the next one."""
    firsts = np.flatnonzero(np.diff(time, prepend=-np.inf) > 0.0)
    index = np.arange(len(time))
    spread = np.interp(index, firsts, time[firsts])
    last = firsts[-1]
    step = np.median(np.diff(time[firsts])) / (len(time) - last)
    return spread + np.where(index > last, (index - last) * step, 0.0)
