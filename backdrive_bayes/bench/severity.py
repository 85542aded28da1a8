"""Severity: how far an effect stands out of the noise once the reducer's parameters have absorbed what they can.

At severity s the effect's strength is such that the remainder r(t) of its angle, after least squares on the sensitivities of
the reducer's parameters, the records' offsets and pasts, has sqrt(Σz⁴/Σz²) = s·``FULL`` with z = r / total noise sd: the
rms weighted by where the effect acts, so that a short bump and a broad bend of equal height count alike.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.channel_noise import ChannelNoise
from backdrive_bayes.bench.effect import Effect
from backdrive_bayes.bench.mechanics import Resolution, Setting, record_angle
from backdrive_bayes.bench.reducer import IN_PROPORTION, IN_SHARES, BenchReducer

FULL = (8.0, 15.0)
"""Range of the height at severity 1, in total noise standard deviations."""

REACH = 2.0
"""How far a parameter may be turned: so many times a factor of e^0.5, or a quarter of a share."""

STEPS_PER_LEG = 90
SAMPLES = 1200
_HELD_BACK = {"load_dependent_friction": "load_friction", "hardening_stiffness": "stiffening"}


@dataclass(frozen=True, eq=False)
class Yardstick:
    """The reducer without effects on coarse samples, and what its parameters can absorb there.

    ``basis`` (samples, directions) is orthonormal; along direction i no more than ``reach[i]`` noise units are absorbed.
    """

    reducer: BenchReducer
    settings: tuple[Setting, ...]
    plain_rad: np.ndarray
    noise_rad: np.ndarray
    basis: np.ndarray
    reach: np.ndarray

    def remainder(self, effects) -> np.ndarray:
        """What of the effects' angle cannot be absorbed, in noise standard deviations, shape (records, samples)."""
        z = (coarse_angle(self.reducer, effects, self.settings) - self.plain_rad) / self.noise_rad
        z -= self.basis @ np.clip(self.basis.T @ z, -self.reach, self.reach)
        return z.reshape(len(self.settings), -1)

    def height(self, effect: Effect) -> float:
        """Height of an effect above what can be absorbed, in noise standard deviations."""
        z = self.remainder((effect,)).ravel()
        energy = float(z @ z)
        return float(np.sqrt(np.sum(z**4) / energy)) if energy > 1e-12 else 0.0


def make_yardstick(reducer: BenchReducer, settings, noise: ChannelNoise, absent=()) -> Yardstick:
    """Yardstick of a unit; ``absent`` names effects whose like a fit is not allowed to turn."""
    plain = coarse_angle(reducer, (), settings)
    slopes = [_slope(a, s) for a, s in zip(_split(plain, settings), settings, strict=True)]
    noise_rad = noise.total_rad(np.concatenate(slopes))
    held = {_HELD_BACK[name] for name in absent if name in _HELD_BACK}
    columns = [_sensitivity(reducer, settings, plain, name) for name in (*IN_PROPORTION, *IN_SHARES) if name not in held]
    columns += _pasts(reducer, settings, plain)
    left, size, _ = np.linalg.svd(np.column_stack(columns) / noise_rad[:, None], full_matrices=False)
    kept = size > 1e-6 * size[0]
    return Yardstick(reducer, tuple(settings), plain, noise_rad, left[:, kept], REACH * size[kept])


def scale_to(effect: Effect, yardstick: Yardstick, height: float, rounds: int = 14) -> Effect:
    """The effect at the strength that gives this height, or at its largest physical strength where that gives less."""
    low, high, strength = 0.0, effect.most, min(effect.guess, effect.most)
    for k in range(rounds if height > 0.0 else 0):
        found = yardstick.height(replace(effect, strength=strength))
        if abs(found / height - 1.0) < 0.04 or (found < height and strength == effect.most):
            return replace(effect, strength=float(strength))
        low, high = (strength, high) if found < height else (low, strength)
        strength *= float(np.clip(height / max(found, 1e-9), 0.1, 10.0))
        if not low < strength < high or k > rounds // 2:
            strength = effect.most if high == effect.most else 0.5 * (low + high)
    return replace(effect, strength=0.0 if height == 0.0 else float(0.5 * (low + high)))


def coarse_angle(reducer, effects, settings):
    """Noise-free angle [rad] of all records on some SAMPLES samples each, joined."""
    return np.concatenate([record_angle(reducer, effects, s, _coarse(s)) for s in settings])


def _coarse(setting):
    return Resolution(STEPS_PER_LEG, setting.path.end_s / SAMPLES)


def _split(values, settings):
    return np.split(values, len(settings))


def _sensitivity(reducer, settings, plain, name):
    """Change of the angle [rad] when a parameter is turned by one unit of REACH."""
    value = getattr(reducer, name)
    unit = 0.5 * value if name in IN_PROPORTION else 0.25
    turned = replace(reducer, **{name: value + 0.05 * unit})
    return (coarse_angle(turned, (), settings) - plain) / 0.05


def _pasts(reducer, settings, plain):
    """Columns of each record alone: its offset, and two other pasts."""
    columns, blocks = [], _split(np.arange(plain.size), settings)
    for setting, block in zip(settings, blocks, strict=True):
        columns.append(np.zeros(plain.size))
        columns[-1][block] = 10.0 * reducer.angle_rad
        for side in (-1.0, 1.0):
            path = _with_past(setting.path, side, reducer)
            column = np.zeros(plain.size)
            column[block] = record_angle(reducer, (), replace(setting, path=path), _coarse(setting)) - plain[block]
            columns.append(column)
    return columns


def _with_past(path, side, reducer):
    kept = path.time_s >= 0
    peak = side * np.abs(path.torque_nm).max()
    before = -np.array([2.0, 1.0]) * abs(peak) / path.rate_nm_per_s
    return replace(path, time_s=np.r_[before, path.time_s[kept]], torque_nm=np.r_[0.0, peak, path.torque_nm[kept]])


def _slope(angle_rad, setting):
    return np.gradient(angle_rad, _coarse(setting).sampling_s) / setting.path.rate_nm_per_s
