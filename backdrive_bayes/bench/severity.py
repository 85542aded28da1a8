"""Severity: how far an effect stands out of the noise once the reducer's parameters have absorbed what they can.

At severity s the effect's strength is such that the remainder r(t) of its angle, after least squares on the sensitivities of
the reducer's parameters, the records' offsets and initial states, has sqrt(Σz⁴/Σz²) = s·``FULL`` with z = r / total noise sd:
the rms weighted by where the effect acts, so that a short bump and a broad bend of equal height count alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from backdrive_bayes.bench.channel_noise import ChannelNoise
from backdrive_bayes.bench.protocol import BenchEffect, Circumstances, Mechanics

FULL = (8.0, 15.0)
"""Range of the height at severity 1, in total noise standard deviations."""

REACH_STEPS = 50
"""How far a parameter may be turned to make an effect look smaller, in steps of a reducer's ``turned``."""

SAMPLES = 1200


@dataclass(frozen=True, eq=False)
class Yardstick:
    """The reducer without effects on coarse samples, and what its parameters can absorb there.

    ``basis`` (samples, directions) is orthonormal; along direction i no more than ``reach[i]`` noise units are absorbed.
    """

    mechanics: Mechanics
    reducer: Any
    records: tuple[Circumstances, ...]
    plain_rad: np.ndarray
    noise_rad: np.ndarray
    basis: np.ndarray
    reach: np.ndarray

    def change(self, effects) -> np.ndarray:
        """Change of the angle by effects, in noise standard deviations, shape (records·samples,)."""
        return (coarse_angle(self.mechanics, self.reducer, effects, self.records) - self.plain_rad) / self.noise_rad

    def beyond(self, change) -> np.ndarray:
        """What of a change cannot be absorbed, of the same shape."""
        return change - self.basis @ np.clip(self.basis.T @ change, -self.reach, self.reach)

    def remainder(self, effects) -> np.ndarray:
        """What of the effects' angle cannot be absorbed, in noise standard deviations, shape (records, samples)."""
        return self.beyond(self.change(effects)).reshape(len(self.records), -1)

    def height(self, effect: BenchEffect) -> float:
        """Height of an effect above what can be absorbed, in noise standard deviations."""
        return height_of(self.remainder((effect,)))


def height_of(z) -> float:
    """sqrt(Σz⁴/Σz²), 0 where z vanishes."""
    energy = float(np.sum(z**2))
    return float(np.sqrt(np.sum(z**4) / energy)) if energy > 1e-12 else 0.0


def make_yardstick(mechanics: Mechanics, reducer, records, noise: ChannelNoise, absent=()) -> Yardstick:
    """Yardstick of a unit; ``absent`` names effects whose like a fit is not allowed to turn."""
    records = tuple(records)
    plain = coarse_angle(mechanics, reducer, (), records)
    slopes = [_slope(a, r) for a, r in zip(np.split(plain, len(records)), records, strict=True)]
    noise_rad = noise.total_rad(np.concatenate(slopes))
    columns = [coarse_angle(mechanics, other, (), records) - plain for other in reducer.turned(tuple(absent))]
    columns += _offsets_and_states(mechanics, reducer, records, plain)
    left, size, _ = np.linalg.svd(np.column_stack(columns) / noise_rad[:, None], full_matrices=False)
    kept = size > 1e-6 * size[0]
    return Yardstick(mechanics, reducer, records, plain, noise_rad, left[:, kept], REACH_STEPS * size[kept])


def scale_to(effect: BenchEffect, yardstick: Yardstick, height: float, rounds: int = 14) -> BenchEffect:
    """The effect at the strength that gives this height, or at its largest physical strength where that gives less."""
    low, high, strength, closest = 0.0, None, min(effect.guess, effect.most), (np.inf, 0.0)
    for k in range(rounds if height > 0.0 else 0):
        found = yardstick.height(replace(effect, strength=strength))
        closest = min(closest, (abs(np.log(max(found, 1e-9) / height)), strength))
        if abs(found / height - 1.0) < 0.04 or (found < height and strength == effect.most):
            break
        low, high = (strength, high) if found < height else (low, strength)
        strength = min(strength * float(np.clip(height / max(found, 1e-9), 0.1, 10.0)), effect.most)
        if high is not None and (not low < strength < high or k > rounds // 2):
            strength = 0.5 * (low + high)
    return replace(effect, strength=float(closest[1]))


def coarse_times(where: Circumstances):
    """The SAMPLES + 1 times [s] of a record at which severity looks."""
    return np.linspace(0.0, where.path.end_s, SAMPLES + 1)


def coarse_angle(mechanics: Mechanics, reducer, effects, records):
    """Noise-free angle [rad] of all records at ``coarse_times``, joined."""
    return np.concatenate([mechanics.angle(reducer, tuple(effects), where, coarse_times(where)) for where in records])


def _offsets_and_states(mechanics, reducer, records, plain):
    """Columns of each record alone: its offset, and the change by two other initial states, per step of a parameter."""
    columns, blocks = [], np.split(np.arange(plain.size), len(records))
    for where, block in zip(records, blocks, strict=True):
        columns.append(np.zeros(plain.size))
        columns[-1][block] = reducer.angle_rad
        for side in (-1.0, 1.0):
            other = replace(where, path=_from_side(where.path, side))
            column = np.zeros(plain.size)
            column[block] = mechanics.angle(reducer, (), other, coarse_times(where)) - plain[block]
            columns.append(2.0 * column / REACH_STEPS)
    return columns


def _from_side(path, side):
    kept = path.time_s >= 0
    peak = side * np.abs(path.torque_nm).max()
    before = -np.array([2.0, 1.0]) * abs(peak) / path.rate_nm_per_s
    return replace(path, time_s=np.r_[before, path.time_s[kept]], torque_nm=np.r_[0.0, peak, path.torque_nm[kept]])


def _slope(angle_rad, where):
    return np.gradient(angle_rad, where.path.end_s / SAMPLES) / where.path.rate_nm_per_s
