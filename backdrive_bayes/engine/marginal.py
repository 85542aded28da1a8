"""Gaussian algebra of a conditionally linear model: weights, offsets and the noise scale are integrated exactly.

y = X w + noise, w ~ σ N(0, diag(s²)), noise ~ σ N(0, C) with known C and a scaled inverse-chi-square prior on σ² of ``noise_dof``
degrees of freedom, a flat offset for each record. X and y are whitened by C and free of the offsets.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dtrtri

LOG_SCALES = (-14.0, 2.5)
"""Range of log standard deviations of weights: beyond it nothing changes but rounding errors."""
SWEEPS = 40
"""Newton steps for the log scales at most; some ten are needed."""


@dataclass(frozen=True, eq=False)
class Solution:
    """Posterior of the weights at given scales.

    ``mean`` (weights,), ``root`` (weights, weights) with covariance root·rootᵀ·``variance``, ``chi2`` what remains,
    ``log_marginal``
    the log marginal likelihood up to a constant of the data and the noise.
    """

    mean: np.ndarray
    root: np.ndarray
    chi2: float
    variance: float
    log_marginal: float


@dataclass(frozen=True, eq=False)
class Whitened:
    """Whitened columns ``x`` (samples, weights) and data ``y`` (samples,) with the number of independent samples.

    ``log_volume`` is what the whitening itself adds to the log marginal likelihood. ``gram`` (weights, weights), ``moment``
    (weights,) and ``total`` are the inner products of columns and data that every solution needs.
    """

    x: np.ndarray
    y: np.ndarray
    samples: float
    noise_dof: float
    log_volume: float = 0.0
    gram: np.ndarray = field(init=False)
    moment: np.ndarray = field(init=False)
    total: float = field(init=False)

    def __post_init__(self):
        object.__setattr__(self, "gram", self.x.T @ self.x)
        object.__setattr__(self, "moment", self.x.T @ self.y)
        object.__setattr__(self, "total", float(self.y @ self.y))

    def coarsened(self, power: float) -> Whitened:
        """The same with the likelihood raised to a power, as if there were fewer independent samples of the same noise."""
        root = np.sqrt(power)
        return Whitened(self.x * root, self.y * root, self.samples * power, self.noise_dof, self.log_volume)

    def solve(self, scale) -> Solution:
        """Posterior of the weights for standard deviations ``scale`` (weights,)."""
        inner = self.gram * np.outer(scale, scale)
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        seen = solve_triangular(lower, scale * self.moment, lower=True, check_finite=False)
        inverse = dtrtri(lower, lower=1)[0]
        chi2 = max(self.total - float(seen @ seen), 0.0)
        root = scale[:, None] * inverse.T
        dof = self.noise_dof + self.samples
        log_marginal = -0.5 * dof * np.log1p(chi2 / self.noise_dof) - float(np.log(np.diag(lower)).sum())
        return Solution(root @ seen, root, chi2, (self.noise_dof + chi2) / dof, log_marginal)

    def log_marginal(self, scale) -> float:
        """Log marginal likelihood alone, up to a constant."""
        inner = self.gram * np.outer(scale, scale)
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False, overwrite_a=True)
        seen = solve_triangular(lower, scale * self.moment, lower=True, check_finite=False)
        chi2 = max(self.total - float(seen @ seen), 0.0)
        return -0.5 * (self.noise_dof + self.samples) * np.log1p(chi2 / self.noise_dof) - float(np.log(np.diag(lower)).sum())


@dataclass(frozen=True, eq=False)
class Scales:
    """Which weights share a scale, and the normal prior of each log scale.

    ``group`` (weights,) numbers the scales; ``mean`` and ``sd`` (scales,), a standard deviation of zero fixes a scale.
    """

    group: np.ndarray
    mean: np.ndarray
    sd: np.ndarray

    @property
    def free(self) -> np.ndarray:
        """Whether a scale is inferred, (scales,)."""
        return self.sd > 0

    def of_weights(self, log_scale) -> np.ndarray:
        """Standard deviation of every weight."""
        return np.exp(np.clip(log_scale, *LOG_SCALES))[self.group]

    def log_prior(self, log_scale) -> float:
        """Log density of the free scales without its constant."""
        free = self.free
        return float(-0.5 * np.sum(((log_scale[free] - self.mean[free]) / self.sd[free]) ** 2))


def find_scales(data: Whitened, scales: Scales, start=None, sweeps: int = SWEEPS) -> tuple[np.ndarray, Solution]:
    """Mode of the log scales by damped Newton steps with MacKay's effective number of parameters for the curvature.

    Source: MacKay, Neural Computation 4, 1992, 415-447.
    """
    log_scale = np.array(scales.mean if start is None else start, float)
    free = scales.free
    solution = data.solve(scales.of_weights(log_scale))
    count = np.bincount(scales.group, minlength=free.size)
    for _ in range(sweeps):
        scale = scales.of_weights(log_scale)
        size = np.bincount(scales.group, (solution.mean / scale) ** 2, free.size) / solution.variance
        left = np.bincount(scales.group, np.sum((solution.root / scale[:, None]) ** 2, axis=1), free.size)
        learnt = count - left
        precision = np.where(free, 1.0 / np.where(free, scales.sd, 1.0) ** 2, 0.0)
        gradient = size - learnt - precision * (log_scale - scales.mean)
        step = np.where(free, np.clip(gradient / (size + learnt + precision + 1e-9), -1.0, 1.0), 0.0)
        log_scale = np.clip(log_scale + step, *LOG_SCALES)
        solution = data.solve(scales.of_weights(log_scale))
        if np.abs(step).max() < 0.01:
            break
    return log_scale, solution


def whiten(columns, angles, covariances, noise_dof: float, trust=None) -> Whitened:
    """Whiten records' columns (blocks, weights) and angles (blocks,) and take out each record's offset.

    ``trust`` (blocks,) of each record is the power to which a block's likelihood, given the blocks before it, is raised.
    """
    parts, volume, samples = [], 0.0, -float(len(columns))
    trust = [np.ones(angle.size) for angle in angles] if trust is None else trust
    for block, angle, covariance, power in zip(columns, angles, covariances, trust, strict=True):
        lower = np.linalg.cholesky(covariance)
        both = solve_triangular(lower, np.column_stack([block, angle, np.ones(angle.size)]), lower=True, check_finite=False)
        both *= np.sqrt(power)[:, None]
        samples += float(power.sum())
        length = np.linalg.norm(both[:, -1])
        one = both[:, -1] / length
        volume -= float(power @ np.log(np.diag(lower)) + np.log(length))
        parts.append(both[:, :-1] - np.outer(one, one @ both[:, :-1]))
    joined = np.concatenate(parts)
    return Whitened(joined[:, :-1], joined[:, -1], samples, noise_dof, volume)
