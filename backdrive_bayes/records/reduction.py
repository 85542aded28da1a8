"""Reduce a raw record to block means with the block covariance that goes with them.

50 000 to 300 000 samples become some hundreds of blocks, short where the angle moves fast. The torque of a block comes from
a smooth path through the noisy torque channel, because history operators must not be driven by noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline, make_lsq_spline
from scipy.optimize import isotonic_regression

from backdrive_bayes.records.faults import gaps_after
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.record import Record

SAME_TIP = 0.05
"""Turning points that differ by less, in shares of the largest torque, are of the same tips."""
AT_TIP = 0.9
"""Share of the largest torque from which on a record begins at a tip."""
LONG_GAP = 0.25
"""Gaps longer than this share of a usual block cut blocks."""
FEW = 6
"""Samples up to which a block's mean is that of its samples: the steps between them are then no part of what was read."""
MOST_KINKS = 12
"""Kinks of a leg's torque at most: a dwell has two, a rounded tip a few."""
CLEARLY = 10.0
"""Gain in twice the log likelihood, beyond what its parameters cost, for which a more winding torque path is believed."""
NEAR = 1 / 16
RADII = np.r_[0.0, 0.5 ** np.arange(11.0, 4.0, -1.0)]
RADII_PRIOR = np.r_[0.5, np.full(7, 0.5 / 7)]
"""Share of a leg near its tips in which rounding is looked for, its radii in shares of the leg's duration, and their prior: as
many benches turn at once as do not."""
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

    @property
    def amplitude_nm(self) -> float:
        """Mean |torque| of the turning points that are about as far out as the farthest [N·m]; a record's ends are none."""
        reached = np.abs(self.turning_nm[1:-1] if self.turning_nm.size > 2 else self.turning_nm)
        return float(reached[reached > (1.0 - SAME_TIP) * reached.max()].mean())

    @property
    def begins_at_tip(self) -> bool:
        """Whether the record begins at a turning point of its own size, which wipes out what was before."""
        return bool(abs(self.turning_nm[0]) >= AT_TIP * np.abs(self.turning_nm).max())

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
    # No block reaches over a gap that is long beside it: its mean would be of one end or the other.
    gaps = gaps_after(record.time_s) + 1
    missed = record.time_s[gaps] - record.time_s[gaps - 1]
    for k, s in enumerate(segments):
        part = np.ptp(record.torque_nm[s.start : s.stop]) / span
        wanted = int(np.ceil(blocks_per_segment * max(part, 0.1)))
        cut = s.start + _block_edges(record.angle_rad[s.start : s.stop], wanted, noise)
        long = missed > LONG_GAP * (record.time_s[s.stop - 1] - record.time_s[s.start]) / wanted
        cut = np.union1d(cut, gaps[long & (gaps > s.start) & (gaps < s.stop)])
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
    torque_sd = max(torque_sd, 1e-6 * float(np.ptp(record.torque_nm)), np.finfo(float).tiny**0.25)
    # Turning points lie between the last sample of one segment and the first of the next.
    inner = [0.5 * (record.time_s[s.start - 1] + record.time_s[s.start]) for s in segments[1:]]
    corner = np.r_[record.time_s[0], inner, record.time_s[-1]]
    trends, keeps = [], []
    for k, s in enumerate(segments):
        own = leg == k
        trend, keep = _trend(mid[own], mean[own], count[own], torque_sd, record.time_s[[s.start, s.stop - 1]])
        trends.append(trend)
        keeps.append(keep)
    trends = _rounded(record, segments, trends, corner, torque_sd)
    ends = np.array([trend(corner[k : k + 2]) for k, trend in enumerate(trends)])
    for k, s in enumerate(segments):
        own = leg == k
        path[own] = isotonic_regression(s.direction * trends[k](mid[own]), weights=count[own]).x * s.direction
        variance[own] = torque_sd**2 * (keeps[k] / count[own] + 2.0 / count[own].sum())
        common[own] = torque_sd**2 / count[own].sum()
    turning = np.r_[ends[0, 0], 0.5 * (ends[:-1, 1] + ends[1:, 0]), ends[-1, 1]]
    for k in range(len(segments)):
        own = leg == k
        path[own] = np.clip(path[own], *sorted(turning[k : k + 2]))
    return path, variance, common, turning


def _rounded(record, segments, trends, corner, torque_sd):
    """The trends (functions of time, one a leg) less what rounded tips lack.

    A ramp of slope s that turns within a radius ρ of time lacks s(√(x² + ρ²) - |x|) at the distance x from its tip. All tips of a
    record are rounded alike; radii, and no rounding, are averaged over by their likelihood in the samples near the tips.
    """
    longest = max(record.time_s[s.stop - 1] - record.time_s[s.start] for s in segments)
    reach, radii, chi2, tips = NEAR * longest, longest * RADII, np.zeros(RADII.size), []
    for k, (s, trend) in enumerate(zip(segments, trends, strict=True)):
        time, torque = record.time_s[s.start : s.stop], record.torque_nm[s.start : s.stop]
        # The first and the last sample of a record are no tips.
        for tip, inward in ((corner[k], 1.0),) * (k > 0) + ((corner[k + 1], -1.0),) * (k + 1 < len(segments)):
            slope = (trend(tip) - trend(tip + inward * reach)) / reach
            near = np.abs(time - tip) <= reach
            left = torque[near] - trend(time[near])
            chi2 += [np.sum((left + _lacks(time[near] - tip, slope, r)) ** 2) / torque_sd**2 for r in radii]
            tips.append((k, tip, slope))
    share = RADII_PRIOR * np.exp(-0.5 * (chi2 - chi2.min()))
    share /= share.sum()

    def less(k):
        own = [(tip, slope) for leg, tip, slope in tips if leg == k]
        lacks = lambda t: sum(w * _lacks(t - tip, slope, r) for tip, slope in own for w, r in zip(share, radii, strict=True))  # noqa: E731
        return lambda t: trends[k](t) - lacks(t)

    return [less(k) for k in range(len(segments))]


def _lacks(apart, slope, radius):
    """What a ramp lacks at times ``apart`` from its rounded tip."""
    return slope * (np.hypot(apart, radius) - np.abs(apart))


def _trend(time, mean, count, torque_sd, bounds):
    """A line through the block means, one with kinks (dwells, rounded tips), or a cubic spline (a torque that sways): whichever
    the noise asks for; and the weight that the block means themselves have beside it.

    That is the Wiener weight: what varies beyond the sensor's white noise is real torque. The trend then runs straight from
    block to block and on to the tips.
    """
    weight = np.sqrt(count) / torque_sd
    best, best_score = None, np.inf
    for spline in _splines(time, mean, weight, bounds):
        # Kinks have a place each, even knots do not.
        chosen = spline.t.size - 4 if spline.k == 1 else 0
        score = np.sum((weight * (mean - spline(time))) ** 2) + (spline.c.size + chosen) * np.log(time.size)
        if score < best_score - CLEARLY:
            best, best_score = spline, score
    level = best(time) if best is not None else mean
    excess = float(np.mean((weight * (mean - level)) ** 2)) - 1.0
    if best is not None and excess <= 5 / np.sqrt(time.size):
        return best, 0.0
    keep = excess / (excess + 1.0) if best is not None else 1.0
    nodes = level + keep * (mean - level)
    return (make_interp_spline(time, nodes, 1) if time.size > 1 else lambda t: np.full(np.shape(t), nodes[0])), keep


def _splines(time, mean, weight, bounds):
    """Cubic splines of even pieces, and lines with no kink, one, two, … each put where the last one leaves most."""
    for pieces in (8, 32):
        if time.size >= 3 * (pieces + 3):
            inner = np.quantile(time, np.linspace(0, 1, pieces + 1))[1:-1]
            yield make_lsq_spline(time, mean, np.r_[[bounds[0]] * 4, inner, [bounds[1]] * 4], 3, w=weight)
    kinks: list[float] = []
    while time.size >= 3 * (len(kinks) + 2) and len(kinks) <= MOST_KINKS:
        inner = np.sort(kinks)
        line = make_lsq_spline(time, mean, np.r_[[bounds[0]] * 2, inner, [bounds[1]] * 2], 1, w=weight)
        yield line
        left = weight * (mean - line(time))
        if np.sum(left**2) < time.size:
            return
        kinks.append(_kink(time, left, weight, np.r_[bounds[0], inner, bounds[1]]))


def _kink(time, left, weight, knots) -> float:
    """Where in the piece that fits worst one more kink takes most of what is ``left`` (blocks,), already weighted."""
    piece = np.clip(np.searchsorted(knots, time, side="right") - 1, 0, knots.size - 2)
    sizes = np.bincount(piece, minlength=knots.size - 1)
    misfit = np.where(sizes >= 4, np.bincount(piece, left**2, knots.size - 1), -1.0)
    own = piece == int(np.argmax(misfit))
    at, w = time[own], weight[own]
    ramp = np.linalg.qr(w[:, None] * np.stack([np.ones(at.size), at - at.mean()], axis=1))[0]
    hinges = w[:, None] * np.maximum(at[:, None] - at[None, 1:-1], 0.0)
    hinges -= ramp @ (ramp.T @ hinges)
    gains = (left[own] @ hinges) ** 2 / np.maximum(np.sum(hinges**2, axis=0), 1e-300)
    return float(at[1:-1][np.argmax(gains)])
