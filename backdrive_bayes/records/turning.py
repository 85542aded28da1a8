"""Turning points of a noisy torque history: found on a smoothed copy, then located on the raw samples."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from backdrive_bayes.records.white_noise import white_noise

SHARE = 0.05  # a reversal smaller than this share of the peak-to-peak torque is ripple
_MAIN_SHARE = 0.35  # reversals of this share set the length of a typical segment
NOISE_MULTIPLE = 8.0  # a reversal smaller than so many standard deviations of the noise is noise: it reaches four to either side
_BLOCKS_PER_SEGMENT = 64
LINE_POINTS = 2000  # block means lose nothing of a straight line
_TOP_SHARE = 0.003  # a turning point lies no further below the top, in shares of the range
_MEDIAN_BLOCKS = 9  # kills disturbances shorter than a fourteenth of a segment: a motor's surge across a clearance


def coarse_turning_points(torque_nm: np.ndarray) -> list[int]:
    """Indices of the torque's reversals to a hundredth of a segment; none in constant or monotone torque.

    Two passes: large reversals tell how long a segment is, then blocks of a fixed share of that length are
    searched for all reversals, so that surges of the drive (short against the ramp, often as large as it) do
    not count.
    """
    if len(torque_nm) < 3:
        return []
    smooth, window = _smoothed(torque_nm)
    span, noise = float(np.ptp(smooth)), white_noise(torque_nm)
    if not span > 4.0 * noise / np.sqrt(window):
        return []
    block = max(1, _segment_length(smooth, span) // _BLOCKS_PER_SEGMENT)
    blocks = median_filter(block_means(torque_nm, block), _MEDIAN_BLOCKS if block > 1 else 5, mode="nearest")
    threshold = max(SHARE * float(np.ptp(blocks)), NOISE_MULTIPLE * noise / np.sqrt(block))
    return [k * block + block // 2 for k in zigzag(blocks.tolist(), threshold)]


def refine_turning_point(time_s: np.ndarray, torque_nm: np.ndarray, left: int, turn: int, right: int) -> int:
    """Locate a reversal near ``turn`` to a sample or two, between its neighbours ``left`` and ``right``.

    Robust lines through both flanks are intersected; with a dwell between equal slopes that is its middle.
    Where the lines do not meet at the top (a long plateau, curved flanks), the middle of the top is returned.
    """
    time, part, turn = time_s[left:right], torque_nm[left:right], turn - left
    top = np.median(part[max(turn - 2, 0) : turn + 3])
    height = part if top >= 0.5 * (part[0] + part[-1]) else -part
    turn = _highest(height, turn)
    clean, noise = _levelled(height)
    middle = left + _on_top(clean, _middle(clean, turn, noise), turn, noise)
    start, stop = _flank(clean[: turn + 1], noise)
    end, begin = (len(height) - edge for edge in _flank(clean[turn:][::-1], noise))
    if min(stop - start, end - begin) < 3:
        return middle
    rising, falling = _line(time[start:stop], height[start:stop]), _line(time[begin:end], height[begin:end])
    meeting = _intersection(rising, falling, time[turn])
    if meeting is None or not time[stop - 1] <= meeting <= time[begin]:
        return middle
    if _value(rising, meeting) > _percentile(height[stop - 1 : begin + 1], 90) + 0.1 * np.ptp(height):
        return middle
    index = int(np.searchsorted(time, meeting))
    index -= int(time[index] - meeting > meeting - time[index - 1])
    return left + _on_top(clean, index, turn, noise)


def _on_top(clean: np.ndarray, index: int, turn: int, noise: float) -> int:
    """``index`` if the torque is highest there; else, where flanks are bent, the middle of the samples that are."""
    below = max(_TOP_SHARE * float(np.ptp(clean)), 4.0 * noise)
    if clean[min(index, len(clean) - 1)] >= clean[turn] - below:
        return index
    low = clean < clean[turn] - below
    first, last = np.flatnonzero(low[:turn]), np.flatnonzero(low[turn:])
    begin = int(first[-1]) + 1 if first.size else 0
    end = turn + int(last[0]) if last.size else low.size
    return (begin + end) // 2


def _smoothed(torque: np.ndarray) -> tuple[np.ndarray, int]:
    clean = median_filter(torque, 5, mode="nearest")  # single wild samples are drop-outs, not reversals
    span = float(np.ptp(clean))
    noise = white_noise(torque)
    if span <= 0.0 or noise <= 0.0:
        return clean, 1
    # as long as the noise asks for, but never so long that a reversal of a short cycle is lost
    window = int(np.clip((noise / (0.01 * span)) ** 2, 1, max(len(torque) // 60, 1)))
    return uniform_filter1d(clean, window, mode="nearest"), window


def _segment_length(smooth: np.ndarray, span: float) -> int:
    """Length in samples of a typical segment: a tenth of the record lies in shorter ones."""
    step = max(1, len(smooth) // 20_000)
    turns = [step * k for k in zigzag(smooth[::step].tolist(), _MAIN_SHARE * span)]
    lengths = np.sort(np.diff([0, *turns, len(smooth)]))
    return int(lengths[np.searchsorted(np.cumsum(lengths), 0.1 * len(smooth))])


def block_means(values: np.ndarray, block: int) -> np.ndarray:
    """Means of blocks of so many samples each; what is left over at the end is left out."""
    count = max(len(values) // block, 1)
    return values[: count * block].reshape(count, -1).mean(axis=1)


def zigzag(levels, threshold: float) -> list[int]:
    """Indices of the extremes from which the signal comes back by at least ``threshold``; written so that it can be compiled."""
    turns: list[int] = []
    low = high = 0
    direction = 0
    for k in range(len(levels)):
        level = levels[k]
        if level > levels[high]:
            high = k
        if level < levels[low]:
            low = k
        if direction >= 0 and level <= levels[high] - threshold:
            if direction != 0:
                turns.append(high)
            direction, low = -1, k
        elif direction <= 0 and level >= levels[low] + threshold:
            if direction != 0:
                turns.append(low)
            direction, high = 1, k
        if direction > 0:
            low = k
        elif direction < 0:
            high = k
    return turns


def _highest(height: np.ndarray, turn: int) -> int:
    """Highest sample of a smoothed copy near ``turn``, which blocks may have moved along a short flank."""
    before, after = turn, len(height) - turn
    reach = min(before // 2, after // 2, max(before, after) // 25 + 4)
    part = height[turn - reach : turn + reach + 1]
    if len(part) < 9:
        return turn
    smooth = uniform_filter1d(median_filter(part, 5, mode="nearest"), max(len(part) // 16, 1), mode="nearest")
    tops = np.flatnonzero(smooth == smooth.max())
    return turn - reach + int(tops[len(tops) // 2])


def _levelled(height: np.ndarray) -> tuple[np.ndarray, float]:
    """Copy of ``height`` smoothed so far that its levels can be told apart, and the noise left in it."""
    noise, span = white_noise(height), float(np.ptp(height))
    window = int(np.clip((noise / (0.01 * span)) ** 2, 1, max(len(height) // 40, 1))) if span > 0.0 else 1
    return uniform_filter1d(height, window, mode="nearest") if window > 1 else height, noise / np.sqrt(window)


def _flank(height: np.ndarray, noise: float) -> tuple[int, int]:
    """Range of a rising flank that is clear of both its ends; ``height`` ends at the top."""
    if len(height) < 4:
        return 0, len(height)
    low, high = _percentile(height, [2, 98]) + np.array([2.0, -2.0]) * noise
    # counting samples below a level finds its crossing on a monotone flank, whatever the noise
    start = int(np.count_nonzero(height < low + 0.3 * (high - low)))
    stop = int(np.count_nonzero(height < high - max(0.06 * (high - low), 2.0 * noise)))
    return start, max(stop, start)


def _middle(height: np.ndarray, turn: int, noise: float) -> int:
    """Middle of the samples at the top, between the crossings of one level on either side."""
    before, after = height[: turn + 1], height[turn:]
    top = min(_percentile(before, 98), _percentile(after, 98)) - 2.0 * noise
    level = top - max(0.06 * min(np.ptp(before), np.ptp(after)), 2.0 * noise)
    first, last = np.count_nonzero(before < level), len(height) - np.count_nonzero(after < level)
    return max(1, int(first + last) // 2)


def _percentile(values: np.ndarray, percent):
    return np.percentile(values[:: max(1, len(values) // 20_000)], percent)


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Line (time origin, level there, slope) through the samples, outliers trimmed once."""
    block = max(1, len(x) // LINE_POINTS)
    x, y = block_means(x, block), block_means(y, block)
    origin = float(x.mean())
    level, slope = _least_squares(x - origin, y)
    residual = np.abs(y - level - slope * (x - origin))
    keep = residual <= 4.0 * 1.4826 * np.median(residual) + 1e-12 * np.abs(y).max()
    if 3 <= np.count_nonzero(keep) < len(x):
        level, slope = _least_squares(x[keep] - origin, y[keep])
    return origin, level, slope


def _least_squares(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Level at zero and slope of the straight line; closed form, as polyfit costs five times as much here."""
    centre = float(x.mean())
    slope = float((x - centre) @ y) / max(float((x - centre) @ (x - centre)), np.finfo(float).tiny)
    return float(y.mean()) - slope * centre, slope


def _value(line: tuple[float, float, float], time: float) -> float:
    origin, level, slope = line
    return level + slope * (time - origin)


def _intersection(up, down, near: float) -> float | None:
    if not (up[2] > 0.0 > down[2]):
        return None
    return near + (_value(down, near) - _value(up, near)) / (up[2] - down[2])
