"""Size, speed and closure of a record's loop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.branches import Branch, Segment

_FULL = 0.8  # reversals of at least this share of the largest count for the amplitude
_TIP = 0.05  # share of the amplitude next to a tip on which its angle is read


def turning_levels(torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> np.ndarray:
    """Torque in N·m at the turning points, extrapolated along the segments so that noise adds no bias."""
    levels = []
    for segment in segments[:-1]:
        part = torque_nm[segment.start : segment.stop]
        part = part[-max(len(part) // 10, min(3, len(part))) :]
        line = np.polyfit(np.arange(len(part)), part, 1) if len(part) > 2 else (0.0, part.mean())
        levels.append(float(np.polyval(line, len(part) - 0.5)))
    return np.array(levels)


def extremes(torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> tuple[float, float]:
    """Lowest and highest torque in N·m between which the full cycles run."""
    levels = _levels(torque_nm, segments)
    high, low = levels.max(), levels.min()
    return (
        float(np.median(levels[levels <= low + (1 - _FULL) * abs(low)])),
        float(np.median(levels[levels >= high - (1 - _FULL) * abs(high)])),
    )


def loading_rate(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
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


def cycle_count(torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> float:
    """Torque travelled over that of one full cycle."""
    low, high = extremes(torque_nm, segments)
    return float(np.abs(np.diff(_levels(torque_nm, segments))).sum() / (2.0 * (high - low))) if high > low else 0.0


def _levels(torque: np.ndarray, segments: tuple[Segment, ...]) -> np.ndarray:
    """Torque at the record's start, its turning points and its end."""
    return np.r_[np.median(torque[:5]), turning_levels(torque, segments), np.median(torque[-5:])]


def closure(time_s, torque_nm, angle_rad, branches: tuple[Branch, ...], noise) -> dict | None:
    """Angle at the end of the last full cycle minus that a cycle earlier, both at the same torque.

    The tip is approached on the same branch both times and the angle is read from a line over its last part.
    ``basis`` says whether the earlier approach was already in the settled loop or still the first loading.
    None where no cycle comes back to its tip.
    """
    tips = _tips(time_s, torque_nm, angle_rad, branches)
    pair = next(((a, b) for b in reversed(tips) for a in tips if b.key == (a.label, a.cycle + 1)), None)
    if pair is None:
        return None
    before, after = pair
    torque = min((tip.torque_nm for tip in pair), key=abs)
    first = f"{before.label} of the first loading and of the loop"
    return {
        "difference_rad": after.angle_at(torque) - before.angle_at(torque),
        "sd_rad": float(np.sqrt(before.variance(noise) + after.variance(noise))),
        "torque_Nm": torque,
        "cycle": after.cycle,
        "basis": "settled loop" if before.cycle > 0 else first,
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
