"""Exact covariance of block means under Ornstein-Uhlenbeck plus white noise."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.reduction import Blocks


def block_covariance(blocks: Blocks, noise: NoiseEstimate, slope_rad_per_nm=0.0) -> np.ndarray:
    """Covariance of the block means of the angle [rad²], shape (blocks, blocks).

    The correlated part is the double time average of σ² exp(-|t-t'|/t_c) over each pair of blocks; the white part falls
    with the number of samples; the torque path's error enters through ``slope_rad_per_nm`` (blocks,).
    """
    correlation = noise.correlation_time_s
    span = blocks.end_s - blocks.begin_s
    ratio = span / correlation
    # expm1 keeps the averages accurate for blocks much shorter than the correlation time.
    average = -np.expm1(-ratio) / ratio
    gap = np.abs(blocks.mid_s[:, None] - blocks.mid_s[None, :]) - 0.5 * (span[:, None] + span[None, :])
    matrix = average[:, None] * average[None, :] * np.exp(-np.maximum(gap, 0.0) / correlation)
    np.fill_diagonal(matrix, 2 * _one_minus_average(ratio, average))
    matrix *= noise.correlated_rad**2
    white = noise.white_rad**2 / blocks.count
    matrix[np.diag_indices_from(matrix)] += white + slope_rad_per_nm**2 * blocks.torque_variance_nm2
    return matrix


def _one_minus_average(ratio, average):
    """(1 - average) / ratio, by its series where the difference cancels."""
    series = 0.5 - ratio / 6 + ratio**2 / 24 - ratio**3 / 120
    return np.where(ratio < 1e-2, series, (1 - average) / np.maximum(ratio, 1e-300))


def whitener(covariance: np.ndarray) -> np.ndarray:
    """Lower-triangular W with W C Wᵀ = I, same shape."""
    lower = np.linalg.cholesky(covariance)
    return solve_triangular(lower, np.eye(lower.shape[0]), lower=True)
