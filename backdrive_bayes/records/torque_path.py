"""The path of the torque along a record: straight pieces, as few as the samples ask for.

History operators must not be driven by the noise of the torque channel, and must not be spared what the torque does: ramps,
dwells, stairs, rounded tips and torque by hand are straight pieces all, of which a sine has many.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline, make_lsq_spline

from backdrive_bayes.records.record import Record

MOST_BINS, MOST_PIECES = 2000, 200
"""Bins of a leg's samples in which knots are looked for, and pieces, at most."""
LEAST_BINS = 2
"""Bins of a piece at least."""
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

    A turning point lies where the pieces about it meet; pieces that do not meet are joined from sample to sample. The samples
    next to it tell on neither side, for they may lie beyond it.
    """
    bend, legs = STRAIGHT * float(np.ptp(record.torque_nm)), []
    for k, s in enumerate(segments):
        few = s.stop - s.start < FEW
        own = slice(s.start + (k > 0 and not few), s.stop - (k + 1 < len(segments) and not few))
        legs.append(_leg(record.time_s[own], record.torque_nm[own], sd_nm, bend))
    nodes, values, samples = (list(x) for x in legs[0])
    turning = [_extended(nodes, values, 0, ends_s[0])]
    for s, (later, on, count) in zip(segments[1:], legs[1:], strict=True):
        slope, next_slope = np.diff(values[-2:]) / np.diff(nodes[-2:]), np.diff(on[:2]) / np.diff(later[:2])
        apart = on[0] - values[-1] - float(next_slope[0]) * (later[0] - nodes[-1])
        meet = nodes[-1] + apart / (float(slope[0] - next_slope[0]) or np.inf)
        if nodes[-2] < meet < later[1]:
            nodes[-1], values[-1] = meet, values[-1] + float(slope[0]) * (meet - nodes[-1])
            turning.append(values[-1])
            later, on = later[1:], on[1:]
        else:
            turning.append(max(values[-1], on[0], key=lambda value: -s.direction * value))
            samples.append(1)
        nodes, values, samples = [*nodes, *later], [*values, *on], [*samples, *count]
    turning.append(_extended(nodes, values, -1, ends_s[1]))
    return TorquePath(np.array(nodes), np.array(values), np.array(turning), np.array(samples))


def _extended(nodes, values, end, time_s) -> float:
    """The torque where the first or the last piece, drawn out, is at ``time_s``, which becomes its end."""
    inner = 1 if end == 0 else -2
    values[end] += (values[end] - values[inner]) / (nodes[end] - nodes[inner]) * (time_s - nodes[end])
    nodes[end] = time_s
    return float(values[end])


def _leg(time_s, torque_nm, sd_nm, bend_nm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Knots (knots,) [s] of one leg from its first sample to its last, the torque there, and samples (knots - 1,) of the pieces.

    Knots are added one a piece where they gain most, while that is more than a place and a slope cost (Schwarz, Annals of
    Statistics 6, 1978).
    """
    edges = np.unique(np.linspace(0, time_s.size, min(time_s.size, MOST_BINS) + 1).astype(int))
    count = np.diff(edges)
    time, mean = (np.add.reduceat(v, edges[:-1]) / count for v in (time_s, torque_nm))
    weight = 1.0 / np.sqrt(sd_nm**2 / count + bend_nm**2)
    if time.size < 2:
        return time_s[[0, -1]] + [0.0, 1e-9], np.full(2, mean[0]), count
    knots, straight = np.array([], int), set()
    while True:
        # A knot lies at a bin.
        nodes = np.r_[time_s[0], time[knots], time_s[-1]]
        line = make_lsq_spline(time, mean, np.r_[nodes[0], nodes, nodes[-1]], 1, w=weight)
        bounds = np.r_[0, knots, time.size]
        left, more = mean - line(time), []
        for a, z in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
            gain, at = (0.0, a) if (a, z) in straight else _kink(time[a:z], left[a:z], weight[a:z])
            if gain > 2.0 * np.log(time.size):
                more.append((gain, a + at))
            else:
                straight.add((a, z))
        room = MOST_PIECES - bounds.size + 1
        if not more or not room:
            return nodes, line.c, np.diff(np.r_[0, np.cumsum(count)][bounds])
        knots = np.sort(np.r_[knots, [at for _, at in sorted(more, reverse=True)[:room]]])


def _kink(time, left, weight) -> tuple[float, int]:
    """What one kink in a piece takes most of what is ``left`` (bins,), as twice a gain in log likelihood, and its bin."""
    if time.size < 2 * LEAST_BINS:
        return 0.0, 0
    at = (time - time[0]) / (time[-1] - time[0])
    ramp = np.linalg.qr(weight[:, None] * np.stack([np.ones(at.size), at], axis=1))[0]
    white = weight * left
    white = weight * (white - ramp @ (ramp.T @ white))
    # Sums from each bin to the end make all inner products with max(t - t_j, 0) at once.
    ahead = lambda values: np.cumsum(values[::-1], axis=0)[::-1]  # noqa: E731
    moment = ahead(white * at) - at * ahead(white)
    w2 = weight**2
    s0, s1, s2 = ahead(w2), ahead(w2 * at), ahead(w2 * at**2)
    wide = weight[:, None] * ramp
    across = ahead(wide * at[:, None]) - at[:, None] * ahead(wide)
    size = s2 - 2 * at * s1 + at**2 * s0 - np.sum(across**2, axis=1)
    gain = np.where(size > 1e-9 * s2[0], moment**2 / np.maximum(size, 1e-300), 0.0)[LEAST_BINS:-LEAST_BINS]
    best = int(np.argmax(gain)) if gain.size else 0
    return (float(gain[best]), best + LEAST_BINS) if gain.size else (0.0, 0)
