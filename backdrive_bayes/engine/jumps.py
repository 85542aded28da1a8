"""Stick-slip: small jumps of the angle in the direction of motion, looked for in the samples themselves.

Between jumps the angle hangs behind, at a jump it leaps ahead. Differences of means over half a correlation time before and
after an instant show leaps above the slow noise; noise, vibration and an encoder's error leap either way alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from backdrive_bayes.engine.linear import Linear

STEEP = 6.0
"""Slopes beyond so many times the median are clearances being crossed: nothing is looked for there."""
SHARES = (0.003, 0.01, 0.03, 0.1, 0.3)
SIZES = (3.0, 6.0, 12.0, 24.0)
"""Shares of instants with a jump, and jump sizes in noise standard deviations, that are averaged over."""
STRAY = 1e-3
"""Share of instants at which something else moves the angle either way."""
FEWEST = 6
"""Jumps below which there is no stick-slip but single events."""
LARGE = 5.0
"""Noise standard deviations from which a leap is counted."""
SAME, SHIFT = 0.0015, 0.008
"""Distances in torque within which leaps are the same, and by which they are moved to see what chance gives."""
MOST_REPEATED = 0.3


@dataclass(frozen=True)
class Jumps:
    """Log Bayes factor of leaps ahead over leaps back, their number, and their typical size [rad]."""

    log_factor: float
    count: int
    size_rad: float


def find_jumps(linear: Linear) -> Jumps:
    """Evidence for jumps in the direction of motion in all records together.

    Leaps that come at the same torque on other legs are steps of the operator (teeth that engage) and no stick-slip.
    """
    leaps, sizes, places = [], [], []
    reduced, scale = linear.reduced, linear.reduced.torque_scale_nm
    for record, blocks, trust, predicted, noise in zip(
        reduced.unit.records, reduced.blocks, reduced.trust, linear.predicted, reduced.noise, strict=True
    ):
        found = _leaps(record, blocks, trust == 1.0, predicted * reduced.angle_scale_rad, noise)
        if found is not None:
            leap, size, time = found
            leaps.append(leap)
            sizes.append(size)
            places += _places(blocks, time[leap > LARGE], scale)
    if not leaps:
        return Jumps(0.0, 0, 0.0)
    leap, size = np.concatenate(leaps), np.concatenate(sizes)
    large = leap > LARGE
    count = int(large.sum())
    factor = _mixture(leap) - _mixture(-leap)
    if count < FEWEST or _repeated(places) > MOST_REPEATED:
        return Jumps(min(factor, 0.0), count, 0.0)
    return Jumps(factor, count, float(np.median((leap * size)[large])))


def _places(blocks, times, scale):
    """Torques of leaps on each leg, mirrored where it falls."""
    torque = np.interp(times, blocks.mid_s, blocks.torque_nm) / scale
    leg = blocks.leg[np.clip(np.searchsorted(blocks.begin_s, times, side="right") - 1, 0, blocks.count.size - 1)]
    return [torque[leg == k] * blocks.direction[k] for k in range(blocks.direction.size)]


def _repeated(places) -> float:
    """Share of leaps that come again at the same torque on other legs, beyond chance (leaps moved by SHIFT)."""
    excess, total = 0.0, 0
    for k, own in enumerate(places):
        others = np.sort(np.concatenate([p for i, p in enumerate(places) if i != k] or [np.empty(0)]))
        if own.size and others.size:
            excess += np.sum(_near(own, others)) - 0.5 * sum(np.sum(_near(own + s, others)) for s in (-SHIFT, SHIFT))
            total += own.size
    return excess / max(total, 1)


def _near(values, others):
    at = np.searchsorted(others, values)
    left, right = others[np.clip(at - 1, 0, others.size - 1)], others[np.clip(at, 0, others.size - 1)]
    return np.minimum(np.abs(values - left), np.abs(values - right)) < SAME


def _leaps(record, blocks, trusted, predicted_rad, noise):
    """Differences of means in noise standard deviations, signed by the direction of motion, and that deviation [rad]."""
    step = float(np.median(np.diff(record.time_s)))
    half = max(2, int(round(0.5 * noise.correlation_time_s / step)))
    if record.time_s.size < 40 * half:
        return None
    rest = record.angle_rad - np.interp(record.time_s, blocks.mid_s, predicted_rad)
    mean = np.convolve(rest, np.full(half, 1.0 / half), "valid")
    difference = mean[half:] - mean[:-half]
    at = np.arange(difference.size) + half
    time = record.time_s[at]
    slope = np.abs(np.gradient(predicted_rad, blocks.mid_s))
    block = np.clip(np.searchsorted(blocks.begin_s, time, side="right") - 1, 0, blocks.count.size - 1)
    wide = np.maximum.reduce([np.roll(slope, k) for k in (-2, -1, 0, 1, 2)])
    direction = blocks.direction[blocks.leg[block]]
    turning = np.abs(np.diff(np.r_[direction, direction[-1:]])) > 0
    calm = (trusted & (wide < STEEP * np.median(slope)))[block] & ~np.convolve(turning, np.ones(4 * half), "same").astype(bool)
    value, instant = (difference * direction)[calm], time[calm]
    if value.size < 20:
        return None
    sd = max(1.4826 * float(np.median(np.abs(value - np.median(value)))), 1e-300)
    # The leap is taken where it is largest in its neighbourhood, at the resolution of the differences.
    pieces = value[: value.size // half * half].reshape(-1, half)
    at = np.arange(pieces.shape[0]), np.argmax(np.abs(pieces - np.median(value)), axis=1)
    largest, instants = pieces[at], instant[: pieces.size].reshape(pieces.shape)[at]
    leap = (largest - np.median(value)) / sd / np.sqrt(1.0 + np.log(max(half, 1)) / 2)
    return leap, np.full(leap.size, sd), instants


def _mixture(leap) -> float:
    """Log likelihood ratio of jumps among Gaussian noise, on the positive side, averaged over their size and share."""
    found, wide = [], 1.0 + SIZES[-1] ** 2
    stray = np.log(STRAY) - 0.5 * np.log(wide) + 0.5 * leap**2 * (1 - 1 / wide)
    for size in SIZES:
        variance = 1.0 + size**2
        either = -0.5 * np.log(variance) + 0.5 * leap**2 * (1 - 1 / variance)
        ahead = np.where(leap > 0, either + np.log(2.0), -np.inf)
        for share in SHARES:
            jumps = np.logaddexp(np.log(1.0 - share - STRAY), np.log(share) + ahead)
            found.append(np.sum(np.logaddexp(jumps, stray) - np.logaddexp(np.log1p(-STRAY), stray)))
    return float(logsumexp(found) - np.log(len(found)))
