"""Reduce a raw record to block means with the block covariance that goes with them.

50 000 to 300 000 samples become some hundreds of blocks, short where the angle moves fast. The torque of a block comes from
a smooth path through the noisy torque channel, because history operators must not be driven by noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from backdrive_bayes.records.faults import gaps_after
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.record import Record
from backdrive_bayes.records.torque_path import follow_torque
from backdrive_bayes.records.turning import zigzag

SAME_TIP = 0.05
"""Turning points that differ by less, in shares of the largest torque, are of the same tips."""
AT_TIP = 0.9
"""Share of the largest torque from which on a record begins at a tip."""
RESTING, AT_TURN = 0.05, 0.03
"""Rate, in shares of the usual one, below which the torque rests and a film of lubricant stays as it is; and how near to a turn
of the path, in shares of its range, a rest is one at a tip: as much as passes while a film takes on a new speed."""
SHORTEST = 0.1
"""Share of a full leg's blocks that even the shortest leg gets."""
LONG_GAP = 0.25
"""Gaps longer than this share of a usual block cut blocks."""
FEW = 6
"""Samples up to which a block's mean is that of its samples: the steps between them are then no part of what was read."""
LEAST_NOISE = 1e-6
"""Noise of a torque that is read without any, in shares of its range."""
HALVINGS = 3
"""How often the blocks next to a turning point are halved, down to FEW samples: the peak is the angle of a point, block means are
not."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """Block means of one record, all arrays of shape (blocks,).

    ``torque_nm`` is the mean of the torque's path over the block, ``torque_variance_nm2`` what is left of the torque channel's
    noise in it; ``begin_s`` and ``end_s`` bound the block in time, ``count`` is its number of samples. ``leg`` numbers the
    monotone legs, ``turning_nm`` (shape (legs + 1,)) are the torques at their ends, ``direction`` (legs,) is ±1.
    ``bend_rad`` is what has been taken off the mean angle for the curve's bend within the block. ``torque_trend_nm2`` is the
    variance of the level of a leg's torque, an error that all its blocks share. The path is straight between ``path_s`` [s], at
    which it is ``path_nm`` [N·m].
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
    torque_trend_nm2: np.ndarray
    path_s: np.ndarray
    path_nm: np.ndarray

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
    def tips_nm(self) -> tuple[float, float]:
        """Mean torques of the turning points that are about as low as the lowest and as high as the highest [N·m]."""
        inner = self.turning_nm[1:-1] if self.turning_nm.size > 3 else self.turning_nm
        near = SAME_TIP * np.abs(inner).max()
        return float(inner[inner < inner.min() + near].mean()), float(inner[inner > inner.max() - near].mean())

    @property
    def begins_at_tip(self) -> bool:
        """Whether the record begins at a turning point of its own size, which wipes out what was before."""
        return bool(abs(self.turning_nm[0]) >= AT_TIP * np.abs(self.turning_nm).max())

    def edges_nm(self) -> np.ndarray:
        """Torque at the beginning and the end of each block along the path [N·m], shape (2, blocks), from the first sample to the
        last."""
        half = 0.5 * (self.end_s - self.begin_s)[[0, -1]] / self.count[[0, -1]]
        inside = np.clip([self.begin_s, self.end_s], self.begin_s[0] + half[0], self.end_s[-1] - half[1])
        return np.interp(inside, self.path_s, self.path_nm)


_zigzag = numba.njit(cache=True, nogil=True)(zigzag)
"""The search for turning points, compiled: paths are gone through again and again."""


def loading_rate(time_s, torque) -> float:
    """Mean rate of a path that is straight between instants [s], without its rests where it turns, begins or ends [its unit a
    second]: what passes at less than RESTING of it, less than AT_TURN of the range away from there. Zero where the torque never
    moves."""
    torque = np.asarray(torque, float)
    way, spans, least = np.diff(torque), np.diff(time_s), AT_TURN * float(np.ptp(torque))
    if least == 0.0:
        return 0.0
    turns = np.r_[0, np.array(_zigzag(torque, least), int), torque.size - 1]
    leg = np.searchsorted(turns, np.arange(way.size), side="right") - 1
    middle = 0.5 * (torque[1:] + torque[:-1])
    near = np.minimum(np.abs(middle - torque[turns[leg]]), np.abs(middle - torque[turns[leg + 1]])) < least
    rests = near & (way == 0.0)
    while True:
        rate = float(np.abs(way[~rests]).sum() / max(spans[~rests].sum(), 1e-300))
        more = rests | (near & (np.abs(way) < RESTING * rate * spans))
        if np.array_equal(more, rests):
            return rate
        rests = more


def full_legs(record: Record, segments) -> float:
    """Number of a record's legs, each in shares of its whole torque range, but no less than SHORTEST."""
    return float(sum(_shares(record, segments)))


def _shares(record, segments):
    span = np.ptp(record.torque_nm)
    return [max(np.ptp(record.torque_nm[s.start : s.stop]) / span, SHORTEST) for s in segments]


def reduce_record(record: Record, segments, noise: NoiseEstimate, blocks_per_segment: int = 200) -> Blocks:
    """Block means of a record cut into monotone ``segments``.

    A segment that spans the record's whole torque range gets ``blocks_per_segment`` blocks, a shorter one its part; half
    of them are spread evenly in time, half along the angle.
    """
    step = float(np.median(np.diff(record.time_s)))
    edges, leg = [], []
    # No block reaches over a gap that is long beside it: its mean would be of one end or the other.
    gaps = gaps_after(record.time_s) + 1
    missed = record.time_s[gaps] - record.time_s[gaps - 1]
    for k, (s, share) in enumerate(zip(segments, _shares(record, segments), strict=True)):
        wanted = int(np.ceil(blocks_per_segment * share))
        cut = s.start + _block_edges(record.angle_rad[s.start : s.stop], wanted, noise)
        long = missed > LONG_GAP * (record.time_s[s.stop - 1] - record.time_s[s.start]) / wanted
        cut = np.union1d(cut, gaps[long & (gaps > s.start) & (gaps < s.stop)])
        edges.append(cut[:-1])
        leg += [k] * (cut.size - 1)
    starts = np.concatenate(edges)
    stops = np.r_[starts[1:], segments[-1].stop]
    count = stops - starts
    number, begin, end = np.array(leg), record.time_s[starts] - 0.5 * step, record.time_s[stops - 1] + 0.5 * step
    sd = max(noise.torque_nm, LEAST_NOISE * float(np.ptp(record.torque_nm)), np.finfo(float).tiny**0.25)
    path = follow_torque(record, segments, sd, (begin[0], end[-1]))
    return Blocks(
        name=record.name,
        torque_nm=path.mean_nm(begin, end),
        angle_rad=np.add.reduceat(record.angle_rad, starts) / count,
        torque_variance_nm2=sd**2 * path.variance(0.5 * (begin + end)),
        begin_s=begin,
        end_s=end,
        count=count,
        leg=number,
        turning_nm=path.turning_nm,
        direction=np.array([s.direction for s in segments]),
        bend_rad=np.zeros(count.size),
        torque_trend_nm2=sd**2 / np.bincount(number, count)[number],
        path_s=path.time_s,
        path_nm=path.torque_nm,
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
