"""Noise of a bench's channels, drawn anew for each unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, ornstein_uhlenbeck

FRACTION = 0.15
"""Share of a channel's noise that what hides in it may have at most: it stays below what can be told."""


@dataclass(frozen=True)
class ChannelNoise:
    """Standard deviations [rad, N·m] and the correlation time [s] of the slow part of the angle's noise."""

    white_rad: float
    correlated_rad: float
    correlation_time_s: float
    torque_nm: float

    def total_rad(self, slope_rad_per_nm):
        """Standard deviation [rad] of one angle sample where the loop has this slope, torque noise included."""
        return np.sqrt(self.white_rad**2 + self.correlated_rad**2 + (slope_rad_per_nm * self.torque_nm) ** 2)


def draw_noise(rng, reducer) -> ChannelNoise:
    """Noise like that of measured loops: 0.12-0.4 % of the half angle slow, less than half of that white, 0.05-0.15 % of T_r."""
    slow = reducer.angle_rad * log_uniform(rng, 1.2e-3, 4e-3)
    torque = reducer.rated_torque_nm * log_uniform(rng, 5e-4, 1.5e-3)
    return ChannelNoise(slow * rng.uniform(0.3, 0.5), slow, rng.uniform(0.02, 0.04), torque)


def angle_noise(rng, samples: int, step_s: float, noise: ChannelNoise):
    """White noise plus a stationary Ornstein-Uhlenbeck process [rad], shape (samples,)."""
    slow = ornstein_uhlenbeck(rng, samples, np.exp(-step_s / noise.correlation_time_s))
    return noise.correlated_rad * slow + noise.white_rad * rng.standard_normal(samples)
