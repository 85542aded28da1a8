"""Exact covariance of block means under Ornstein-Uhlenbeck plus white noise."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.reduction import Blocks

BEND_ERROR = 0.3
"""Relative standard error of the correction for the curve's bend within a block: it was made at one mode, of one past."""
SHORTEST_RUN = 1e-4
"""Least step of the torque over which a slope is taken, in the range of the torque."""


def channel_covariance(blocks: Blocks, noise: NoiseEstimate) -> np.ndarray:
    """Covariance of the block means of the angle [rad²], (blocks, blocks), from the angle channel.

    The correlated part is the mean of σ² exp(-|t-t'|/t_c) over all pairs of samples of two blocks, as geometric sums; the white
    part falls with the number of samples. A corrected mean carries part of its correction as error.
    """
    matrix = _correlated(blocks, noise.correlated_rad, noise.correlation_time_s)
    if noise.wander_rad:
        matrix += _correlated(blocks, noise.wander_rad, noise.wander_time_s)
    white = noise.white_rad**2 / blocks.count
    matrix[np.diag_indices_from(matrix)] += white + (BEND_ERROR * blocks.bend_rad) ** 2
    return matrix


def _correlated(blocks: Blocks, sd_rad: float, time_s: float) -> np.ndarray:
    """Covariance of the block means of an Ornstein-Uhlenbeck process [rad²]."""
    n, span = blocks.count, blocks.end_s - blocks.begin_s
    # Samples some hundred correlation times apart are independent to the last bit.
    decay = np.minimum(span / n / time_s, 500.0)
    # expm1 keeps the sums accurate for samples much closer than the correlation time.
    total = np.expm1(-n * decay) / np.expm1(-decay)
    apart = np.abs(blocks.mid_s[:, None] - blocks.mid_s[None, :]) - 0.5 * (span[:, None] + span[None, :])
    apart = np.maximum(apart, 0.0) / time_s + 0.5 * (decay[:, None] + decay[None, :])
    matrix = np.outer(total / n, total / n) * np.exp(-apart)
    np.fill_diagonal(matrix, (n + 2 * (n - total) / np.expm1(decay)) / n**2)
    return matrix * sd_rad**2


def local_slope(blocks: Blocks, angle_rad, least_nm: float = 0.0) -> np.ndarray:
    """|dθ/dτ| of an angle at the blocks [rad/(N·m)], shape (blocks,), each leg by itself.

    It is a secant over the neighbours, and over no less than the error of a block's own torque and ``least_nm``: where the angle
    steps, an error of the torque cannot move it by more than the step.
    """
    least = np.sqrt(blocks.torque_variance_nm2 + blocks.torque_trend_nm2)
    least = np.maximum(least, max(least_nm, SHORTEST_RUN * np.ptp(blocks.torque_nm)))
    slope = np.zeros(blocks.count.size)
    for k in range(blocks.direction.size):
        own = np.flatnonzero(blocks.leg == k)
        torque, angle = blocks.torque_nm[own], np.asarray(angle_rad)[own]
        near = np.abs(own[:, None] - own) <= 1
        near |= np.abs(torque[:, None] - torque) <= least[own, None]
        rise, run = (
            np.where(near, values, -np.inf).max(axis=1) - np.where(near, values, np.inf).min(axis=1) for values in (angle, torque)
        )
        slope[own] = rise / np.maximum(run, least[own])
    return slope


def path_covariance(blocks: Blocks, slope_rad_per_nm) -> np.ndarray:
    """Error of each block's torque and of the straight path through each leg, in level and tilt, seen through the slope
    [rad²], (blocks, blocks)."""
    slope = np.broadcast_to(slope_rad_per_nm, blocks.count.shape)
    size = slope * np.sqrt(blocks.torque_trend_nm2)
    legs, number = np.unique(blocks.leg, return_inverse=True)
    middle, half = (
        np.array([f(blocks.begin_s[blocks.leg == k][0], blocks.end_s[blocks.leg == k][-1]) for k in legs])[number]
        for f in (lambda a, b: 0.5 * (a + b), lambda a, b: 0.5 * (b - a))
    )
    along = (blocks.mid_s - middle) / half
    same = blocks.leg[:, None] == blocks.leg
    # Level and tilt of a line fitted to evenly spaced samples are independent; the tilt's share at the ends is three.
    matrix = same * np.outer(size, size) * (1 + 3 * np.outer(along, along))
    matrix[np.diag_indices_from(matrix)] += slope**2 * blocks.torque_variance_nm2
    return matrix


def whitener(covariance: np.ndarray) -> np.ndarray:
    """Lower-triangular W with W C Wᵀ = I, same shape."""
    lower = np.linalg.cholesky(covariance)
    return solve_triangular(lower, np.eye(lower.shape[0]), lower=True)
