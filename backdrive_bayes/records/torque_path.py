"""The path of the torque along a record: straight pieces, as few as the samples ask for.

History operators must not be driven by the noise of the torque channel, and must not be spared what the torque does: ramps,
dwells, stairs, rounded tips and torque by hand are straight pieces all, of which a sine has many. Within a leg the path only goes
back where the angle does.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import isotonic_regression

from backdrive_bayes.records.record import Record

MOST_BINS, MOST_PIECES = 2000, 1500
"""Bins of the samples between which a record may be cut, for each leg, and pieces of a record, at most: a corner is then known to
a two-thousandth of a leg, and a history is not much longer than its blocks."""
STRAIGHT = 3e-5
"""Share of a record's torque range by which a piece may bend, though the samples show it: a sine that is read without noise would
have a piece for every sample."""
APART = 2.0
"""Torque, in the noise of a sample, from which on two lines are apart at a sample."""
TIP = 1e6
"""Weight of a tip, over that of any other knot, where a path is made monotone: it stays where it is."""


@dataclass(frozen=True, eq=False)
class TorquePath:
    """Torque of a record, straight between ``time_s`` (knots,) [s], at which it is ``torque_nm`` (knots,) [N·m]; ``turning_nm``
    (legs + 1,) is it where legs begin and end, ``samples`` (knots - 1,) the number of samples behind each piece."""

    time_s: np.ndarray
    torque_nm: np.ndarray
    turning_nm: np.ndarray
    samples: np.ndarray

    def mean_nm(self, begin_s, end_s) -> np.ndarray:
        """Mean torque [N·m] between two instants, arrays of one shape [s]."""
        done = make_interp_spline(self.time_s, self.torque_nm, 1).antiderivative()
        return (done(end_s) - done(begin_s)) / (end_s - begin_s)

    def variance(self, time_s) -> np.ndarray:
        """Error variance of the path at instants [s], in that of a sample: that of a line through the samples of a piece."""
        piece = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, self.samples.size - 1)
        return 2.0 / self.samples[piece]


def follow_torque(record: Record, segments, sd_nm: float, ends_s: tuple[float, float]) -> TorquePath:
    """The path of a record cut into ``segments``, between the instants ``ends_s``; ``sd_nm`` is the noise of a sample.

    Pieces are lines of their own, joined where they meet, else from sample to sample.
    """
    nodes: list[float] = []
    values: list[float] = []
    samples: list[int] = []
    for time_s, torque_nm, count in _pieces(record.time_s, record.torque_nm, sd_nm, MOST_BINS * len(segments)):
        begin, end = time_s.tolist()
        first, last = torque_nm.tolist()
        if nodes:
            slope, beyond = (values[-1] - values[-2]) / (nodes[-1] - nodes[-2]), (last - first) / (end - begin)
            apart, over = first - values[-1] - beyond * (begin - nodes[-1]), first - values[-1] - slope * (begin - nodes[-1])
            meet = nodes[-1] + apart / (slope - beyond) if slope != beyond else np.inf
            # Beyond its own samples a line is only followed where the other's do not tell them apart.
            early, late = meet < nodes[-1] and abs(apart) > APART * sd_nm, meet > begin and abs(over) > APART * sd_nm
            if nodes[-2] < meet < end and not early and not late:
                begin, first = meet, values[-1] + slope * (meet - nodes[-1])
                del nodes[-1], values[-1]
            else:
                samples.append(1)
        nodes += [begin, end]
        values += [first, last]
        samples.append(count)
    for end, inner in ((0, 1), (-1, -2)):
        values[end] += (values[end] - values[inner]) / (nodes[end] - nodes[inner]) * (ends_s[end] - nodes[end])
        nodes[end] = ends_s[end]
    # Samples may share a stamp.
    time = np.maximum.accumulate(nodes) + 1e-12 * (nodes[-1] - nodes[0]) * np.arange(len(nodes))
    weight = np.r_[samples, 0.0] + np.r_[0.0, samples]
    tips = _tips(record, segments, time, np.array(values), weight)
    turns = _turns(record, time, np.array(values), tips, [s.direction for s in segments])
    torque = _monotone(np.array(values), weight, turns)
    return TorquePath(time, torque, torque[tips], np.array(samples))


def _tips(record, segments, time, torque, weight) -> list[int]:
    """Knots at which legs begin and end: between the middles of two, where the torque is best taken as going one way up to there
    and back from there. The farthest need not be it, for where a clearance is crossed a drive surges and rings beyond the tip. So
    are those of the first and the last leg, for a record may begin or end with a bit of another, too short for one of its own."""
    middle = [record.time_s[_middle(record, s)] for s in segments]
    first = max(int(np.searchsorted(time, middle[0])), 1)
    found = [_mode(-segments[0].direction * torque[:first], weight[:first])]
    for s, begin, end in zip(segments, middle, [*middle[1:], np.inf], strict=True):
        first, last = np.searchsorted(time, [begin, end])
        first = min(max(first, found[-1] + 1), time.size - 1)
        own = slice(first, max(last, first + 1))
        found.append(int(first + _mode(s.direction * torque[own], weight[own])))
    return found


def _middle(record, segment) -> int:
    """The sample at which a leg has passed half of its torque, however long it rests at its end."""
    height = segment.direction * record.torque_nm[segment.start : segment.stop]
    return min(segment.start + int(np.count_nonzero(height < 0.5 * (height.min() + height.max()))), segment.stop - 1)


def _mode(height, weight) -> int:
    """Where ``height`` turns if it rises up to there and falls from there: the best of its local maxima, by the sum of what
    is left, not of its squares, which would rather leave out a spike of a few samples than the ramp beyond."""
    padded = np.r_[-np.inf, height, -np.inf]
    tops = np.flatnonzero((height >= padded[:-2]) & (height > padded[2:]))

    def left(values, own):
        return float(own @ np.abs(values - isotonic_regression(values, weights=own).x))

    costs = [left(height[: t + 1], weight[: t + 1]) + left(height[t:][::-1], weight[t:][::-1]) for t in tops]
    return int(tops[np.argmin(costs)])


def _turns(record, time, torque, tips, directions) -> list[int]:
    """Knots at which the path turns: the tips, and within legs both ends of what goes back with the angle. A shaft whose torque
    goes back turns back; where it goes on, the drive has surged, as when a clearance is crossed."""
    found = [tips[0]]
    for direction, begin, end in zip(directions, tips[:-1], tips[1:], strict=True):
        backward = np.r_[0, direction * np.diff(torque[begin : end + 1]) < 0.0, 0].astype(int)
        bounds = begin + np.flatnonzero(np.diff(backward)).reshape(-1, 2)
        for first, last in bounds.tolist():
            if begin < first and last < end and direction * _turned(record, time[first], time[last]) < 0.0:
                found += [first, last]
        found.append(end)
    return found


def _turned(record, begin_s, end_s) -> float:
    """Slope of the angle in time between two instants, up to a positive factor."""
    own = slice(*np.searchsorted(record.time_s, [begin_s, end_s]) + np.array([-1, 1]))
    time = record.time_s[own]
    return float((time - time.mean()) @ record.angle_rad[own])


def _monotone(torque, weight, turns) -> np.ndarray:
    """The path without what goes back between two turns, which stay."""
    weight = weight.copy()
    weight[turns] = TIP * weight.max()
    for begin, end in pairwise(turns):
        own, direction = slice(begin, end + 1), np.sign(torque[end] - torque[begin])
        torque[own] = direction * isotonic_regression(direction * torque[own], weights=weight[own]).x
    return torque


def _pieces(time_s, torque_nm, sd_nm, most) -> list[tuple]:
    """Lines through samples, in turn: the instants of their first and last sample, the torque there, their number.

    The piece is cut that gains most by it, while that is more than a place and another line cost (Schwarz, Annals of Statistics
    6, 1978).
    """
    edges = np.unique(np.linspace(0, time_s.size, min(time_s.size, most) + 1).astype(int))
    # Samples that share a stamp are of one bin.
    inner = edges[1:-1]
    edges = np.r_[0, inner[time_s[inner] > time_s[inner - 1]], time_s.size]
    count = np.diff(edges)
    time, mean = (np.add.reduceat(v, edges[:-1]) / count for v in (time_s, torque_nm))
    weight = 1.0 / (sd_nm**2 / count + (STRAIGHT * float(np.ptp(torque_nm))) ** 2)
    cut = lambda begin, end: (*_cut(time[begin:end], mean[begin:end], weight[begin:end]), begin, end)  # noqa: E731
    waiting, price = [cut(0, count.size)], 3.0 * float(np.log(count.size))
    done: list[tuple[int, int]] = []
    while waiting:
        loss, at, begin, end = heappop(waiting)
        if -loss <= price or len(waiting) + len(done) >= MOST_PIECES:
            done.append((begin, end))
            continue
        heappush(waiting, cut(begin, begin + at))
        heappush(waiting, cut(begin + at, end))
    found = []
    for begin, end in pairwise(_merged(time, mean, weight, [0, *sorted(end for _, end in done)], price)):
        level, slope, _ = _line(_sums(time[begin:end], mean[begin:end], weight[begin:end])[:, -1])
        ends = time_s[[edges[begin], edges[end] - 1]]
        if ends[1] <= ends[0]:
            ends = ends[0] + np.array([0.0, 1e-9])
        found.append((ends, mean[begin] + level + slope * (ends - time[begin]), int(edges[end] - edges[begin])))
    return found


def _merged(time, mean, weight, bounds: list[int], price: float) -> list[int]:
    """The bounds of pieces less those cuts that others made needless, the cheapest first."""

    def cost(a, b, c):
        whole, first, second = (_line(_sums(time[k:m], mean[k:m], weight[k:m])[:, -1])[2] for k, m in ((a, c), (a, b), (b, c)))
        return float(whole - first - second)

    costs = [cost(*bounds[k - 1 : k + 2]) for k in range(1, len(bounds) - 1)]
    while costs and min(costs) <= price:
        k = int(np.argmin(costs)) + 1
        del bounds[k], costs[k - 1]
        for j in {k - 1, k} & set(range(1, len(bounds) - 1)):
            costs[j - 1] = cost(*bounds[j - 1 : j + 2])
    return bounds


def _cut(time, mean, weight) -> tuple[float, int]:
    """What the best cut of the bins takes off twice the negative log likelihood, as a negative number, and its place."""
    if time.size < 4:
        return 0.0, 0
    sums = _sums(time, mean, weight)
    first, whole = sums[:, 1:-2], sums[:, [-1]]
    left = _line(first)[2] + _line(whole - first)[2]
    best = int(np.argmin(left))
    return float(left[best] - _line(whole)[2][0]), best + 2


def _sums(time, mean, weight) -> np.ndarray:
    """Sums (6, bins) of 1, t, y, t², t·y and y² up to each bin, from the first."""
    t, y = time - time[0], mean - mean[0]
    return np.cumsum(weight * np.stack([np.ones(t.size), t, y, t**2, t * y, y**2]), axis=1)


def _line(sums):
    """Level, slope and what is left of weighted lines from their ``sums`` (6, ...)."""
    one, t, y, tt, ty, yy = sums
    wide = np.maximum(tt - t * t / one, 1e-300)
    slope = (ty - t * y / one) / wide
    return (y - slope * t) / one, slope, np.maximum(yy - y * y / one - slope**2 * wide, 0.0)
