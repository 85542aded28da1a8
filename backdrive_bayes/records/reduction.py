"""Reduce a raw record to block means with the block covariance that goes with them.

50 000 to 300 000 samples become some hundreds of blocks, short where the angle moves fast. The torque of a block comes from
a smooth path through the noisy torque channel, because history operators must not be driven by noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_lsq_spline
from scipy.optimize import isotonic_regression

from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.record import Record

FEW = 6
"""Samples up to which a block's mean is that of its samples: the steps between them are then no part of what was read."""
HALVINGS = 3
"""How often the blocks next to a turning point are halved, down to FEW samples: the peak is the angle of a point, block means are
not."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """Block means of one record, all arrays of shape (blocks,).

    ``torque_nm`` is the smooth torque path at the block, ``torque_variance_nm2`` what is left of the torque channel's noise
    in it; ``begin_s`` and ``end_s`` bound the block in time, ``count`` is its number of samples. ``leg`` numbers the
    monotone legs, ``turning_nm`` (shape (legs + 1,)) are the torques at their ends, ``direction`` (legs,) is ±1.
    ``bend_rad`` is what has been taken off the mean angle for the curve's bend within the block. ``torque_trend_nm2`` is the
    variance of the level of the leg's straight torque path, an error that all blocks of a leg share.
    """

    name: str
    torque_nm: np.ndarray
    angle_rad: np.ndarray
    torque_variance_nm2: np.ndarray
    begin_s: np.ndarray
    end_s: np.ndarray
    count: np.ndarray
    leg: np.ndarray
    turning_nm: np.ndarray
    direction: np.ndarray
    bend_rad: np.ndarray
    torque_trend_nm2: np.ndarray | float = 0.0

    @property
    def mid_s(self) -> np.ndarray:
        """Time at the middle of each block [s]."""
        return 0.5 * (self.begin_s + self.end_s)

    def edges_nm(self) -> np.ndarray:
        """Torque at the beginning and the end of each block along the path [N·m], shape (2, blocks)."""
        edges = np.empty((2, self.torque_nm.size))
        for k in range(self.direction.size):
            own = self.leg == k
            time = np.r_[self.begin_s[own][0], self.mid_s[own], self.end_s[own][-1]]
            torque = np.r_[self.turning_nm[k], self.torque_nm[own], self.turning_nm[k + 1]]
            edges[:, own] = np.interp([self.begin_s[own], self.end_s[own]], time, torque)
        return edges


def reduce_record(record: Record, segments, noise: NoiseEstimate, blocks_per_segment: int = 200) -> Blocks:
    """Block means of a record cut into monotone ``segments``.

    A segment that spans the record's whole torque range gets ``blocks_per_segment`` blocks, a shorter one its part; half
    of them are spread evenly in time, half along the angle.
    """
    step = float(np.median(np.diff(record.time_s)))
    span = np.ptp(record.torque_nm)
    edges, leg = [], []
    for k, s in enumerate(segments):
        part = np.ptp(record.torque_nm[s.start : s.stop]) / span
        wanted = int(np.ceil(blocks_per_segment * max(part, 0.1)))
        cut = s.start + _block_edges(record.angle_rad[s.start : s.stop], wanted, noise)
        edges.append(cut[:-1])
        leg += [k] * (cut.size - 1)
    starts = np.concatenate(edges)
    stops = np.r_[starts[1:], segments[-1].stop]
    count = stops - starts
    path, variance, trend, turning = _smooth_torque(record, segments, starts, stops, np.array(leg), noise.torque_nm)
    return Blocks(
        name=record.name,
        torque_nm=path,
        angle_rad=np.add.reduceat(record.angle_rad, starts) / count,
        torque_variance_nm2=variance,
        begin_s=record.time_s[starts] - 0.5 * step,
        end_s=record.time_s[stops - 1] + 0.5 * step,
        count=count,
        leg=np.array(leg),
        turning_nm=turning,
        direction=np.array([s.direction for s in segments]),
        bend_rad=np.zeros(count.size),
        torque_trend_nm2=trend,
    )


def _block_edges(angle, wanted, noise):
    """Sample indices (blocks + 1,) that cut one segment into at most ``wanted`` blocks."""
    n = angle.size
    if n <= wanted:
        return np.arange(n + 1)
    bins = np.linspace(0, n, min(n, 4 * wanted) + 1).astype(int)
    width = np.diff(bins)
    mean = np.add.reduceat(angle, bins[:-1]) / width
    noise_sd = np.hypot(noise.correlated_rad, noise.white_rad / np.sqrt(width.mean()))
    move = np.abs(np.diff(mean, prepend=mean[0]))
    move = np.maximum(move - 2 * noise_sd, 0)
    move = move + np.r_[move[1:], 0]
    along = move / move.sum() if move.sum() > 0 else width / n
    density = np.r_[0.0, np.cumsum(0.5 * width / n + 0.5 * along)]
    cuts = np.interp(np.linspace(0, 1, wanted + 1), density / density[-1], bins)
    near = 0.5 ** np.arange(1, HALVINGS + 1)
    first, last = (near[near * size >= FEW] * size for size in (cuts[1] - cuts[0], cuts[-1] - cuts[-2]))
    cuts = np.r_[cuts, cuts[0] + first, cuts[-1] - last]
    return np.unique(np.round(cuts).astype(int))


def _smooth_torque(record, segments, starts, stops, leg, torque_sd):
    """Torque path at the blocks, its error variance of each block alone and in common with its leg, and the turning torques."""
    count = stops - starts
    mean = np.add.reduceat(record.torque_nm, starts) / count
    mid = np.add.reduceat(record.time_s, starts) / count
    path, variance, common = np.empty((3, mean.size))
    ends = np.empty((len(segments), 2))
    # Turning points lie between the last sample of one segment and the first of the next.
    inner = [0.5 * (record.time_s[s.start - 1] + record.time_s[s.start]) for s in segments[1:]]
    corner = np.r_[record.time_s[0], inner, record.time_s[-1]]
    for k, s in enumerate(segments):
        own = leg == k
        bounds = record.time_s[[s.start, s.stop - 1]]
        trend = _trend(mid[own], mean[own], count[own], torque_sd, bounds)
        level, at_ends = trend(mid[own]), trend(corner[k : k + 2])
        excess = np.mean(count[own] * (mean[own] - level) ** 2) / max(torque_sd, 1e-300) ** 2 - 1
        # Wiener weight of a block mean against the trend: what varies beyond the sensor's white noise is real torque.
        keep = max(excess, 0.0) / (max(excess, 0.0) + 1.0) if excess > 5 / np.sqrt(own.sum()) else 0.0
        level = level + keep * (mean[own] - level)
        path[own] = isotonic_regression(s.direction * level, weights=count[own]).x * s.direction
        variance[own] = torque_sd**2 * (keep / count[own] + 2.0 / count[own].sum())
        common[own] = torque_sd**2 / count[own].sum()
        ends[k] = at_ends
    turning = np.r_[ends[0, 0], 0.5 * (ends[:-1, 1] + ends[1:, 0]), ends[-1, 1]]
    for k in range(len(segments)):
        own = leg == k
        path[own] = np.clip(path[own], *sorted(turning[k : k + 2]))
    return path, variance, common, turning


def _trend(time, mean, count, torque_sd, bounds):
    """A line through the block means, or a cubic spline with more pieces where the noise says that a line is not enough."""
    weight = np.sqrt(count) / max(torque_sd, 1e-6 * np.ptp(mean) + 1e-300)
    best, best_score = None, np.inf
    for pieces in (1, 8, 32):
        degree = 1 if pieces == 1 else 3
        if time.size < 3 * (pieces + degree):
            break
        inner = np.quantile(time, np.linspace(0, 1, pieces + 1))[1:-1]
        knots = np.r_[[bounds[0]] * (degree + 1), inner, [bounds[1]] * (degree + 1)]
        spline = make_lsq_spline(time, mean, knots, degree, w=weight)
        misfit = np.sum((weight * (mean - spline(time))) ** 2)
        score = misfit + (pieces + degree) * np.log(time.size)
        if score < best_score - 10:
            best, best_score = spline, score
    return best if best is not None else (lambda t: np.interp(t, time, mean))
