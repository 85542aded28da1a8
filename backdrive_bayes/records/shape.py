"""Size, speed and closure of a record's loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.branches import Branch, Segment
from backdrive_bayes.records.reduction import SAME_TIP, loading_rate
from backdrive_bayes.records.turning import LINE_POINTS, block_means

_TIP = 0.05  # share of the amplitude next to a tip on which its angle is read
_MEANS = 40  # of a leg's torque, through which its path is drawn
_RESTS = 40  # beginnings of a rest that are tried: apart by less than half a percent of the torque of a leg


def turning_levels(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> np.ndarray:
    """Torque in N·m at the turning points, extrapolated along the segments so that noise adds no bias."""
    last = ((segment.stop - _near_end(segment), segment.stop) for segment in segments[:-1])
    return np.array([_reached(time_s[start:stop], torque_nm[start:stop]) for start, stop in last])


def starting_level(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
    """Torque in N·m at which the record begins, extrapolated likewise: where it begins at a tip, that is a turning point."""
    part = slice(0, _near_end(segments[0]))
    return _reached(-time_s[part][::-1], torque_nm[part][::-1], beyond=0.0)


def _near_end(segment: Segment) -> int:
    """Samples of a leg from which the torque at its end is read."""
    count = segment.stop - segment.start
    return max(count // 10, min(3, count))


def _reached(time_s: np.ndarray, torque_nm: np.ndarray, beyond: float = 0.5) -> float:
    """Torque in N·m that a leg reaches, from its last part: a straight ramp to its end, ``beyond`` steps after the last sample,
    or one that then comes to rest.

    A rest is believed where the squares left fall by more than two parameters are worth (Schwarz's criterion).
    """
    if len(time_s) < 3:
        return float(torque_nm.mean())
    stop = time_s[-1] + beyond * float(np.median(np.diff(time_s)))
    block = max(1, len(time_s) // LINE_POINTS)
    time, torque = (block_means(values[len(values) % block :], block) for values in (time_s, torque_nm))
    count = len(time)
    rests = stop - (stop - time[0]) * np.arange(_RESTS if count > 4 else 1) / _RESTS  # the first of them is no rest
    ramps = np.minimum(time, rests[:, None])
    begun = ramps.mean(axis=1)
    ramps -= begun[:, None]
    product = ramps @ (torque - torque.mean())
    slopes = product / np.sum(ramps**2, axis=1)
    left = np.sum((torque - torque.mean()) ** 2) - slopes * product
    best = int(np.argmin(left))
    if left[best] * count ** (2.0 / max(count - 3, 1)) >= left[0]:
        best = 0
    return float(torque.mean() + slopes[best] * (rests[best] - begun[best]))


def extremes(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> tuple[float, float]:
    """Lowest and highest torque in N·m between which the largest cycles run.

    The record's ends are no tips: they count where they lie further out than all of these.
    """
    levels, (start, end) = turning_levels(time_s, torque_nm, segments), _ends(torque_nm)
    levels = np.r_[levels, [e for e in (start, end) if not levels.size or not levels.min() <= e <= levels.max()]]
    high, low = levels.max(), levels.min()
    return (
        float(np.median(levels[levels <= low + SAME_TIP * abs(low)])),
        float(np.median(levels[levels >= high - SAME_TIP * abs(high)])),
    )


def mean_rate(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
    """Loading rate of a record in N·m/s as ``loading_rate`` defines it, of the path through means of each leg's samples."""
    knots = []
    for segment, level in zip(segments, [*turning_levels(time_s, torque_nm, segments), None], strict=True):
        edges = np.unique(np.linspace(segment.start, segment.stop, _MEANS + 1).astype(int))
        means = (np.add.reduceat(v[: segment.stop], edges[:-1]) / np.diff(edges) for v in (time_s, torque_nm))
        knots.append(tuple(means))
        if level is not None:
            knots.append((time_s[segment.stop - 1 : segment.stop], np.array([level])))
    return loading_rate(*(np.concatenate(channel) for channel in zip(*knots, strict=True)))


def ramp_rate(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
    """Median rate in N·m/s of the segments' middle parts, each weighted by its length."""
    rates, weights = [], []
    for segment in segments:
        time, torque = (time_s[segment.start : segment.stop], segment.direction * torque_nm[segment.start : segment.stop])
        low, high = np.percentile(torque, [2, 98])
        start, stop = (int(np.count_nonzero(torque < low + share * (high - low))) for share in (0.2, 0.8))
        if stop - start > 2:
            rates.append(float(np.polyfit(time[start:stop] - time[start], torque[start:stop], 1)[0]))
            weights.append(len(time))
    if not rates:
        return 0.0
    order = np.argsort(rates)
    half = np.searchsorted(np.cumsum(np.array(weights)[order]), 0.5 * sum(weights))
    return float(np.array(rates)[order][half])


def cycle_count(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
    """Torque travelled over that of one full cycle."""
    low, high = extremes(time_s, torque_nm, segments)
    start, end = _ends(torque_nm)
    levels = np.r_[start, turning_levels(time_s, torque_nm, segments), end]
    return float(np.abs(np.diff(levels)).sum() / (2.0 * (high - low))) if high > low else 0.0


def _ends(torque: np.ndarray) -> tuple[float, float]:
    """Torque at the record's start and end."""
    return float(np.median(torque[:5])), float(np.median(torque[-5:]))


def closure(time_s, torque_nm, angle_rad, branches: tuple[Branch, ...], noise) -> dict | None:
    """Angle at the end of a full cycle minus that a cycle earlier, both at the same torque: of the cycle that closes worst.

    The tip is approached on the same branch both times and the angle is read from a line over its last part. Where there are
    later ones, cycles that begin at the first loading's tip do not count; ``basis`` says so. None where no cycle comes back to
    its tip.
    """
    tips = _tips(time_s, torque_nm, angle_rad, branches)
    before = {(tip.label, tip.cycle + 1): tip for tip in tips}
    pairs = [(before[tip.key], tip) for tip in reversed(tips) if tip.key in before]
    settled = [pair for pair in pairs if pair[0] is not tips[0]]
    if not pairs:
        return None
    return max((_closed(*pair, bool(settled), noise) for pair in settled or pairs), key=lambda one: abs(one["difference_rad"]))


def _closed(before: _Tip, after: _Tip, settled: bool, noise) -> dict:
    torque = min(before.torque_nm, after.torque_nm, key=abs)
    return {
        "difference_rad": after.angle_at(torque) - before.angle_at(torque),
        "sd_rad": float(np.sqrt(before.variance(noise) + after.variance(noise))),
        "torque_Nm": torque,
        "cycle": after.cycle,
        "basis": "settled loop" if settled else f"{before.label} of the first loading and of the loop",
    }


@dataclass(frozen=True)
class _Tip:
    """Line of angle over torque on the last part of a loading branch."""

    label: str
    cycle: int
    torque_nm: float
    slope: float
    angle_rad: float
    samples: int
    seconds: float

    @property
    def key(self) -> tuple[str, int]:
        return self.label, self.cycle

    def angle_at(self, torque_nm: float) -> float:
        return self.angle_rad + self.slope * (torque_nm - self.torque_nm)

    def variance(self, noise) -> float:
        """Variance of the line's end, four times that of a mean; correlated noise counts by its time."""
        independent = min(1.0, 2.0 * noise.correlation_time_s / max(self.seconds, np.finfo(float).tiny))
        white = noise.white_rad**2 + (self.slope * noise.torque_nm) ** 2
        return 4.0 * (white / self.samples + noise.correlated_rad**2 * independent)


def _tips(time, torque, angle, branches: tuple[Branch, ...]) -> list[_Tip]:
    found = [_tip(time, torque, angle, branch) for branch in branches if branch.label.startswith("load")]
    tips = [tip for tip in found if tip is not None]
    largest = {sign: max((abs(tip.torque_nm) for tip in tips if tip.label[-1] == sign), default=0.0) for sign in "+-"}
    return [tip for tip in tips if abs(tip.torque_nm) >= 0.95 * largest[tip.label[-1]]]


def _tip(time, torque, angle, branch: Branch) -> _Tip | None:
    count = branch.stop - branch.start
    level = float(np.median(torque[branch.stop - min(max(3, count // 200), count) : branch.stop]))
    near = branch.start + np.flatnonzero(np.abs(torque[branch.start : branch.stop]) >= (1 - _TIP) * abs(level))
    if len(near) < 4 or np.ptp(torque[near]) == 0.0:
        return None
    slope, at_tip = np.polyfit(torque[near] - level, angle[near], 1)
    seconds = float(time[near[-1]] - time[near[0]])
    return _Tip(branch.label, branch.cycle, level, float(slope), float(at_tip), len(near), seconds)
