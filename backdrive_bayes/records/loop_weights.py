"""Weights by which a record's angles sum up to its cycle's area, height and width: the arithmetic under ``measured_loop``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.record import Record
from backdrive_bayes.records.shape import starting_level, turning_levels

_FULL = 0.9  # of the longest ramp: shorter ones are minor loops or the first loading
_CLOSED = 0.02  # of a ramp, between the first and the last torque of a cycle: a ramp that the record cuts short closes none
_AT_REST = 0.15  # of the amplitude: what begins and ends this near zero torque is a first cycle
_TIP_SHARES = (0.025, 0.05, 0.1)  # of a full ramp's samples, next to a tip
_ZERO_SHARE = 0.0025  # of a full ramp's samples, on either side of zero torque: branches bend within a percent of T
RAMP_SHARE = 0.1  # of a full ramp's samples, on either side: where the torque is taken as a straight ramp
_LEAST = 8  # samples under a straight line; the first share with so many counts
_MOST_CYCLES = 20


@dataclass(frozen=True)
class Cycles:
    """Where a record's cycles are: numbers of their first segments, sample bounds [start, stop), amplitude [N·m].

    ``unclosed`` are each cycle's last torque beyond its first one, in shares of its first ramp; ``slope_rad_per_nm`` is the
    angle's mean slope over the torque.
    """

    settled: bool
    starts: tuple[int, ...]
    unclosed: tuple[float, ...]
    bounds: tuple[tuple[int, int], ...]
    amplitude_nm: float
    slope_rad_per_nm: float


def cycles_of(record: Record, segments) -> Cycles | None:
    """The last settled cycles of a record (two full ramps each), else its first cycle (0, tip, other tip, 0), else None."""
    if len(segments) < 2:
        return None
    ends = np.abs(record.torque_nm[[0, -1]])
    start = starting_level(record.time_s, record.torque_nm, segments)
    levels = np.r_[start, turning_levels(record.time_s, record.torque_nm, (*segments, segments[-1]))]
    ramps = np.abs(np.diff(levels))
    full, amplitude = ramps >= _FULL * ramps.max(), 0.5 * float(ramps.max())
    closed = np.abs(levels[2:] - levels[:-2]) <= _CLOSED * ramps.max()
    pairs = [k for k in range(len(segments) - 1) if full[k] and full[k + 1] and closed[k]]
    starts = tuple(k for k in pairs if (pairs[-1] - k) % 2 == 0)[-_MOST_CYCLES:]
    if not starts:
        rest = len(segments) == 3 and full[1] and np.all(ends <= _AT_REST * amplitude)
        starts = (0,) if rest else ()
    if not starts:
        return None
    last = 1 if pairs else 2
    bounds = tuple((segments[k].start, segments[k + last].stop) for k in starts)
    slope = float(np.ptp(record.angle_rad)) / (2.0 * amplitude)
    unclosed = tuple(float((levels[k + 2] - levels[k]) / (levels[k + 1] - levels[k])) for k in starts)
    return Cycles(bool(pairs), starts, unclosed, bounds, amplitude, slope)


def area_weights(torque_nm: np.ndarray) -> np.ndarray:
    """Weights (samples,) with which the angles of a closed polygon sum to ∮τ dθ; likewise for angles and torque."""
    return 0.5 * (np.roll(torque_nm, 1) - np.roll(torque_nm, -1))


def settled_cycle(record: Record, segments, k: int, unclosed: float) -> dict:
    """Weights (samples,) of area, height, widths (None where zero torque is not passed) and drift of ramps k and k + 1.

    A cycle that ends at another torque than it began at (by the share ``unclosed`` of its first ramp) ends at another angle too,
    without any drift: by as much of the chord between its tips. ``closing`` are the weights of what that is worth in area.
    """
    start, stop = segments[k].start, segments[k + 1].stop
    first, middle, last = (_tip_weights(record, segments, edge) for edge in (k, k + 1, k + 2))
    drift = last - first - unclosed * (middle - first)
    share = np.zeros(len(record.time_s))
    share[start:stop] = np.linspace(0.0, 1.0, stop - start)
    area = np.zeros(len(record.time_s))
    area[start:stop] = area_weights(record.torque_nm[start:stop])
    height = -0.5 * segments[k].direction * (0.5 * (first + last) - middle)
    widths = _both_widths(record, segments, k)
    if widths is not None:
        widths = widths - np.outer(widths @ share, drift)
    closing = (area @ share) * unclosed * (middle - first)
    return {"area": area - (area @ share) * drift, "height": height, "widths": widths, "drift": drift, "closing": closing}


def first_cycle(record: Record, segments, k: int, unclosed: float) -> dict:
    """As ``settled_cycle`` for ramps k to k + 2 from rest to rest, of which the middle one is full; no drift is taken out."""
    start, stop = segments[k].start, segments[k + 2].stop
    area = np.zeros(len(record.time_s))
    area[start:stop] = area_weights(record.torque_nm[start:stop])
    before, after = (_tip_weights(record, segments, edge) for edge in (k + 1, k + 2))
    height = 0.5 * segments[k + 1].direction * (after - before)
    widths = _both_widths(record, segments, k + 1)
    none = np.zeros(len(record.time_s))
    return {"area": area, "height": height, "widths": widths, "drift": none, "closing": none}


def _tip_weights(record: Record, segments, edge: int) -> np.ndarray:
    """Weights that read the angle at turning point ``edge``, on the ramp before it or, at the record's start, after it."""
    segment = segments[max(edge - 1, 0)]
    count = segment.stop - segment.start
    near = next((n for n in (int(share * count) for share in _TIP_SHARES) if n >= _LEAST), min(_LEAST, count))
    span = slice(segment.start, segment.start + near) if edge == 0 else slice(segment.stop - near, segment.stop)
    time = record.time_s[span]
    step = (time[-1] - time[0]) / max(near - 1, 1)
    return _line_weights(record, span, time[0] if edge == 0 else time[-1] + 0.5 * step)


def _both_widths(record: Record, segments, k: int) -> np.ndarray | None:
    """Weights (3, samples) of the width between ramps k and k + 1 at zero torque: over a short window, over one twice as long,
    and over the short one where the torque is taken as straight over half the time only."""
    before, after = (_zero_weights(record, segments[j]) for j in (k, k + 1))
    if before is None or after is None:
        return None
    return segments[k].direction * (after - before)


def _zero_weights(record: Record, segment) -> np.ndarray | None:
    """Weights (3, samples) that read the angle at zero torque on one ramp, None where the ramp does not pass it."""
    torque = segment.direction * record.torque_nm[segment.start : segment.stop]
    time = record.time_s[segment.start : segment.stop]
    crossing, count = _crossing(torque), len(torque)
    reach = _zero_reach(count)
    windows = [_about(crossing, times * reach, count) for times in (1, 2)]
    # The torque is a straight ramp over more samples than the angle is: its zero is known better than they tell.
    ramp = max(int(RAMP_SHARE * count), 2 * reach)
    at, closely = (_instant(time[w], torque[w]) for w in (_about(crossing, n, count) for n in (ramp, ramp // 2)))
    if windows[0].stop - windows[0].start < _LEAST // 2:
        return None
    length = time[windows[1]][-1] - time[windows[1]][0]
    if not time[windows[1]][0] - length <= at <= time[windows[1]][-1] + length:
        return None
    closely = float(np.clip(closely, at - length, at + length))
    short, long = (slice(segment.start + w.start, segment.start + w.stop) for w in windows)
    return np.stack([_line_weights(record, span, t) for span, t in ((short, at), (long, at), (short, closely))])


def _instant(time, torque) -> float:
    """Time [s] at which the straight line through a rising torque passes zero, infinite where it does not rise."""
    slope, level = np.polyfit(time - time.mean(), torque, 1)
    return float(time.mean() - level / slope) if slope > 0.0 else np.inf


def zero_torque_nm(record: Record, segment) -> float:
    """Torque on either side of zero [N·m] over which the width's samples of one ramp lie: none where the torque rests there."""
    torque = segment.direction * record.torque_nm[segment.start : segment.stop]
    near = _about(_crossing(torque), _zero_reach(len(torque)), len(torque))
    time = record.time_s[segment.start : segment.stop][near]
    slope = np.polyfit(time - time.mean(), torque[near], 1)[0]
    return 0.5 * abs(float(slope)) * float(time[-1] - time[0]) * len(time) / (len(time) - 1)


def _crossing(torque: np.ndarray) -> int:
    """Number of the sample at which a rising torque passes zero, the middle one where it rests there."""
    return (int(np.count_nonzero(torque < 0.0)) + int(np.count_nonzero(torque <= 0.0))) // 2


def _zero_reach(count: int) -> int:
    """Samples on either side of zero torque that the width is read from, on a ramp of ``count`` samples."""
    return max(int(_ZERO_SHARE * count), _LEAST // 2)


def _about(centre: int, reach: int, count: int) -> slice:
    return slice(max(centre - reach, 0), min(centre + reach, count))


def _line_weights(record: Record, span: slice, at_s: float) -> np.ndarray:
    """Weights (samples,) of the value at a time of the least-squares line through the samples of ``span``."""
    time = record.time_s[span] - record.time_s[span].mean()
    square = float(time @ time)
    weights = np.zeros(len(record.time_s))
    weights[span] = 1.0 / len(time) + ((at_s - record.time_s[span].mean()) * time / square if square > 0.0 else 0.0)
    return weights
