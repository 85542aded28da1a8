"""The path of the torque along a record: straight pieces, as few as the samples ask for.

History operators must not be driven by the noise of the torque channel, and must not be spared what the torque does: ramps,
dwells, stairs, rounded tips and torque by hand are straight pieces all, of which a sine has many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from backdrive_bayes.records.record import Record

MOST_BINS, MOST_PIECES = 2000, 200
"""Bins of a leg's samples between which it is cut, and pieces, at most."""
FEW = 10
"""Samples below which a leg has none to spare."""
STRAIGHT = 3e-5
"""Share of a record's torque range by which a piece may bend, though the samples show it."""


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

    Pieces are lines of their own, and so are legs: they are joined where they meet, else from sample to sample. The samples next
    to a turning point tell on neither side, for they may lie beyond it.
    """
    bend, pieces, last = STRAIGHT * float(np.ptp(record.torque_nm)), [], []
    for k, s in enumerate(segments):
        few = s.stop - s.start < FEW
        own = slice(s.start + (k > 0 and not few), s.stop - (k + 1 < len(segments) and not few))
        pieces += _pieces(record.time_s[own], record.torque_nm[own], sd_nm, bend)
        last.append(len(pieces) - 1)
    (nodes, values, count), turning = pieces[0], []
    nodes, values, samples = list(nodes), list(values), [count]
    turning.append(_extended(nodes, values, 0, ends_s[0]))
    for k, (later, on, count) in enumerate(pieces[1:]):
        slope, beyond = (float(np.diff(v[-2:])[0] / np.diff(t[-2:])[0]) for v, t in ((values, nodes), (on, later)))
        apart = on[0] - values[-1] - beyond * (later[0] - nodes[-1])
        meet = nodes[-1] + apart / (slope - beyond) if slope != beyond else np.inf
        tip = max(values[-1], on[0], key=lambda value: np.sign(slope) * value)
        if nodes[-2] < meet < later[1]:
            tip = values[-1] + slope * (meet - nodes[-1])
            nodes, values, later, on = nodes[:-1], values[:-1], [meet, later[1]], [tip, on[1]]
        else:
            samples.append(1)
        turning += [float(tip)] if k in last else []
        nodes, values, samples = [*nodes, *later], [*values, *on], [*samples, count]
    turning.append(_extended(nodes, values, -1, ends_s[1]))
    return TorquePath(np.array(nodes), np.array(values), np.array(turning), np.array(samples))


def _extended(nodes, values, end, time_s) -> float:
    """The torque where the first or the last piece, drawn out, is at ``time_s``, which becomes its end."""
    inner = 1 if end == 0 else -2
    values[end] += (values[end] - values[inner]) / (nodes[end] - nodes[inner]) * (time_s - nodes[end])
    nodes[end] = time_s
    return float(values[end])


def _pieces(time_s, torque_nm, sd_nm, bend_nm) -> list[tuple]:
    """Lines through the samples of one leg, in turn: the instants of their first and last sample, the torque there, their number.

    The piece is cut that gains most by it, while that is more than a place and another line cost (Schwarz, Annals of Statistics
    6, 1978).
    """
    edges = np.unique(np.linspace(0, time_s.size, min(time_s.size, MOST_BINS) + 1).astype(int))
    count = np.diff(edges)
    if count.size < 2:
        return [(time_s[[0, -1]] + [0.0, 1e-9], np.full(2, torque_nm.mean()), time_s.size)]
    time, mean = (np.add.reduceat(v, edges[:-1]) / count for v in (time_s - time_s[0], torque_nm - torque_nm.mean()))
    weight = 1.0 / (sd_nm**2 / count + bend_nm**2)
    sums = np.cumsum(weight * np.stack([np.ones(time.size), time, mean, time**2, time * mean, mean**2]), axis=1)
    sums = np.pad(sums, ((0, 0), (1, 0)))
    whole = [_cut(sums, 0, count.size)]
    while len(whole) < MOST_PIECES:
        gain, begin, at, end = max(whole)
        if gain <= 3.0 * np.log(time.size):
            break
        whole.remove((gain, begin, at, end))
        whole += [_cut(sums, begin, at), _cut(sums, at, end)]
    found = []
    for _, begin, _, end in sorted(whole, key=lambda cut: cut[1]):
        level, slope, _ = _line(sums[:, end] - sums[:, begin])
        ends = time_s[[edges[begin], edges[end] - 1]]
        found.append((ends, torque_nm.mean() + level + slope * (ends - time_s[0]), int(edges[end] - edges[begin])))
    return found


def _cut(sums, begin: int, end: int) -> tuple[float, int, int, int]:
    """What the best cut of the bins from ``begin`` to ``end`` gains in twice the log likelihood, with its bounds and place."""
    places = np.arange(begin + 2, end - 1)
    if places.size == 0:
        return 0.0, begin, begin, end
    first, second = sums[:, places] - sums[:, [begin]], sums[:, [end]] - sums[:, places]
    left = _line(first)[2] + _line(second)[2]
    best = int(np.argmin(left))
    return float(_line(sums[:, end] - sums[:, begin])[2] - left[best]), begin, int(places[best]), end


def _line(sums):
    """Level, slope and what is left of weighted lines from their ``sums`` (6, ...) of 1, t, y, t², t·y and y²."""
    one, t, y, tt, ty, yy = sums
    wide = np.maximum(tt - t * t / one, 1e-300)
    slope = (ty - t * y / one) / wide
    return (y - slope * t) / one, slope, np.maximum(yy - y * y / one - slope**2 * wide, 0.0)
