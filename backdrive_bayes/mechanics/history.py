"""A torque history as straight segments, each of which belongs to a block whose mean is wanted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np

from backdrive_bayes.records.reduction import FEW, RESTING, Blocks, loading_rate

FILM = 0.03
"""Torque, in shares of the largest, that passes at the usual rate while a film of lubricant takes on a new speed."""
LEAST_RANGE = 0.05
"""Range of a logarithm of rate or amplitude, and of what a law makes of it, below which it counts as one value: nothing is learnt
of the law from it."""
SHORT = 1e-4
"""Segment, in shares of the lag, along which its output hardly moves."""


@dataclass(frozen=True, eq=False)
class History:
    """Segments of a torque history; all but ``start`` and ``blocks`` have shape (segments,).

    ``z0`` and ``z1`` are the torques at the ends as shares of the unit's largest torque, ``t0`` and ``t1`` the times
    [s], ``block``
    the block that a segment belongs to and ``weight`` its share of the block's time. ``surge`` is the logarithm of the loading
    rate over the history's own at the segments' ends, (2, segments), or zero where it is the same everywhere. ``state`` is
    the one of :data:`backdrive_bayes.mechanics.cells.START` in which it begins. ``largest`` is the torque whose thresholds it
    has, by default its own largest.
    """

    z0: np.ndarray
    z1: np.ndarray
    t0: np.ndarray
    t1: np.ndarray
    block: np.ndarray
    weight: np.ndarray
    blocks: int
    surge: np.ndarray | float = 0.0
    state: str = "neutral"
    largest: float | None = None

    @property
    def start(self) -> float:
        """Torque before the first segment."""
        return float(self.z0[0])

    @cached_property
    def log_amplitude(self) -> float:
        """Logarithm of the largest torque in shares of the unit's."""
        largest = max(np.abs(self.z0).max(), np.abs(self.z1).max()) if self.largest is None else self.largest
        return float(np.log(max(largest, 1e-3)))

    def beside(self, offset: float) -> History:
        """The same at torques that are larger by ``offset``."""
        return replace(self, z0=self.z0 + offset, z1=self.z1 + offset)

    def mean(self, begin, end) -> np.ndarray:
        """Block means (blocks, columns) of quantities that are straight on every segment, given at its ends
        (segments, columns)."""
        out = np.zeros((self.blocks, begin.shape[1]))
        np.add.at(out, self.block, 0.5 * (begin + end) * self.weight[:, None])
        return out


def of_blocks(blocks: Blocks, torque_scale_nm: float, lag_s: float = 0.0) -> History:
    """History behind the blocks of a record; ``lag_s`` is by how much the angle channel is late."""
    sampled, who = _samples(blocks)
    sampled, many, ends = sampled - lag_s, blocks.count > FEW, np.r_[blocks.begin_s[0], blocks.end_s[-1]]
    edges = np.r_[blocks.begin_s[many], blocks.end_s[many], ends] - lag_s
    path = blocks.path_s, blocks.path_nm / torque_scale_nm
    usual = loading_rate(*path)
    cuts = np.unique(np.r_[edges, sampled, blocks.path_s[1:-1], _bends(*path, usual)])
    middle = 0.5 * (cuts[1:] + cuts[:-1])
    owner = np.clip(np.searchsorted(blocks.begin_s - lag_s, middle, side="right") - 1, 0, blocks.count.size - 1)
    # What passes in a gap between two blocks is in the mean of neither.
    span = np.diff(cuts) * ((blocks.count[owner] > FEW) & (middle < blocks.end_s[owner] - lag_s))
    weight = span / np.maximum(np.bincount(owner, span, blocks.count.size)[owner], 1e-300)
    # A sample is a segment without length, after the one that leads to it.
    t0, t1 = np.r_[cuts[:-1], sampled], np.r_[cuts[1:], sampled]
    owner, weight = np.r_[owner, who], np.r_[weight, 1.0 / blocks.count[who]]
    order = np.lexsort((t0, t1))
    z0, z1 = (np.interp(t[order], blocks.path_s, blocks.path_nm) / torque_scale_nm for t in (t0, t1))
    surge = _surge(*path, np.stack([t0[order], t1[order]]), usual)
    # A tip is reached from the other side.
    state = "neutral" if not blocks.begins_at_tip else "lower" if blocks.turning_nm[0] > 0 else "upper"
    return History(z0, z1, t0[order], t1[order], owner[order], weight[order], blocks.count.size, surge, state)


def _samples(blocks: Blocks) -> tuple[np.ndarray, np.ndarray]:
    """Instants [s] of the samples of all blocks that have few, and the blocks they belong to."""
    few = np.flatnonzero(blocks.count <= FEW)
    who = np.repeat(few, blocks.count[few])
    number = np.arange(who.size) - np.repeat(np.cumsum(blocks.count[few]) - blocks.count[few], blocks.count[few])
    share = (number + 0.5) / blocks.count[who]
    return blocks.begin_s[who] + share * (blocks.end_s - blocks.begin_s)[who], who


def through(time_s, torque_nm, torque_scale_nm: float, usual_nm_per_s: float | None = None) -> History:
    """History straight between given samples; segment i ends at sample i + 1 and is a block of its own. Its surge is over the
    ``usual_nm_per_s``, by default its own loading rate."""
    z, count = np.asarray(torque_nm, float) / torque_scale_nm, len(torque_nm) - 1
    time = np.asarray(time_s, float)
    usual = loading_rate(time, z) if usual_nm_per_s is None else usual_nm_per_s / torque_scale_nm
    surge = _surge(time, z, np.stack([time[:-1], time[1:]]), usual)
    return History(z[:-1], z[1:], time[:-1], time[1:], np.arange(count), np.ones(count), count, surge)


def _bends(time_s, z, usual: float) -> np.ndarray:
    """Instants [s] at which the loading rate about them bends, none where it is the same everywhere."""
    if np.ndim(_surge(time_s, z, time_s, usual)) == 0:
        return np.empty(0)
    half = FILM / usual
    found = np.r_[time_s - half, time_s + half]
    return found[(found > time_s[0]) & (found < time_s[-1])]


def _surge(time_s, z, at_s, usual: float) -> np.ndarray | float:
    """Logarithm of the loading rate about instants [s] over the ``usual`` one of a path that is straight between ``time_s``."""
    passed = np.r_[0.0, np.cumsum(np.abs(np.diff(z)))]
    # About every instant of a path within the film lies the whole of it.
    if not passed[-1] > FILM:
        return 0.0
    begin, end = (np.clip(at_s + sign * FILM / usual, time_s[0], time_s[-1]) for sign in (-1.0, 1.0))
    rate = (np.interp(end, time_s, passed) - np.interp(begin, time_s, passed)) / np.maximum(end - begin, 1e-300)
    surge = np.log(np.maximum(rate / usual, RESTING))
    return surge if np.ptp(surge) > LEAST_RANGE else 0.0


@numba.njit(cache=True, nogil=True)
def played(first, z1, threshold):
    """Output of a play operator at the first torque and at every segment's end, (segments + 1,)."""
    out = np.empty(z1.size + 1)
    out[0] = x = first
    for i in range(z1.size):
        x = min(max(x, z1[i] - threshold), z1[i] + threshold)
        out[i + 1] = x
    return out


@numba.njit(cache=True, inline="always")
def lagged(before, first, last, bend, span):
    """Output of a first-order lag at the end of a segment of ``span`` lags, ``before`` at its beginning; the input goes from
    ``first`` to ``last``, straight but for ``bend`` span² (its curvature in lags, halved)."""
    slope = (last - first) / span - bend * span
    return last - slope - 2.0 * bend * span + 2.0 * bend + (before - first + slope - 2.0 * bend) * np.exp(-span)


@numba.njit(cache=True, nogil=True)
def behind(mean, end, t0, t1, lag_s):
    """Mean on every segment (segments,) of the output of a first-order lag of ``lag_s`` [s] whose input has these means and, at
    the segments' ends, these values [any unit], a parabola between; it has caught up with the first. Times are in seconds."""
    out = np.empty(mean.size)
    x = y = end[0]
    for i in range(mean.size):
        span = (t1[i] - t0[i]) / lag_s
        if span < SHORT:
            out[i] = y
            y += span * (mean[i] - y)
        else:
            new = lagged(y, x, end[i], -6.0 * (mean[i] - 0.5 * (x + end[i])) / span**2, span)
            out[i] = mean[i] - (new - y) / span
            y = new
        x = end[i]
    return out
