"""Gaussian algebra of a conditionally linear model: weights, offsets and the noise scale are integrated exactly.

y = X w + noise, w ~ σ N(0, diag(s²)), noise ~ σ N(0, C) with known C and a scaled inverse-chi-square prior on σ² of ``noise_dof``
degrees of freedom, a flat offset for each record. X and y are whitened by C and free of the offsets.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dpotri, dtrtri

LOG_SCALES = (-14.0, 2.5)
"""Range of log standard deviations of weights: beyond it nothing changes but rounding errors."""
SWEEPS, LONGEST_STEP, SETTLED = 40, 1.0, 0.01
"""Newton steps for the log scales at most, some seven are needed; the longest, and one so short that the mode is found."""


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
class Moments:
    """Inner products of whitened columns and data, all that a solution needs, with the number of independent samples.

    ``inner`` is (weights + 1, weights + 1), the data last.
    """

    inner: np.ndarray
    samples: float
    noise_dof: float

    @property
    def dof(self) -> float:
        """Degrees of freedom of the noise scale's posterior."""
        return self.noise_dof + self.samples

    def coarsened(self, power: float) -> Moments:
        """The same with the likelihood raised to a power, as if there were fewer independent samples of the same noise."""
        return Moments(self.inner * power, self.samples * power, self.noise_dof)

    def holding(self, values, held, scale) -> Moments:
        """Moments of the other weights where those ``held`` (weights,) have ``values`` (weights,), with standard deviations
        ``scale`` (weights,): they count as that many more samples, and what comes out is the joint density of both."""
        rest, turned = np.r_[~held, True], np.r_[np.where(held, -values, 0.0), 1.0]
        inner, seen = self.inner[np.ix_(rest, rest)], self.inner @ turned
        inner[-1] = inner[:, -1] = seen[rest]
        inner[-1, -1] = turned @ seen + np.sum((values / scale)[held] ** 2)
        return replace(self, inner=inner, samples=self.samples + float(held.sum()))

    def log_marginal(self, scale) -> np.ndarray:
        """Log marginal likelihoods (...) for standard deviations ``scale`` (..., weights), up to a constant."""
        scale = np.concatenate([scale, np.ones((*np.shape(scale)[:-1], 1))], axis=-1)
        matrix = self.inner * scale[..., :, None]
        matrix *= scale[..., None, :]
        number = np.arange(self.inner.shape[0])
        matrix[..., number, number] += np.where(number < number[-1], 1.0, self.noise_dof)
        # The data's own row of the factor ends in the root of what remains of them.
        log = np.log(np.linalg.cholesky(matrix)[..., number, number])
        return -self.dof * (log[..., -1] - 0.5 * np.log(self.noise_dof)) - log[..., :-1].sum(axis=-1)

    def factor(self, scale) -> tuple[np.ndarray, np.ndarray, float]:
        """Cholesky factor of the precision of the weights over ``scale`` (weights,), the data under it, and what remains of
        them."""
        inner = self.inner[:-1, :-1] * scale[:, None]
        inner *= scale
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False, overwrite_a=True)
        seen = solve_triangular(lower, scale * self.inner[:-1, -1], lower=True, check_finite=False)
        return lower, seen, max(float(self.inner[-1, -1] - seen @ seen), 0.0)

    def draw(self, scale, noise, chance) -> tuple[np.ndarray, np.ndarray]:
        """Weights (weights, draws) for standard normal ``noise`` (weights, draws) and the noise scales (draws,) for chi-square
        ``chance`` (draws,) of ``dof`` degrees of freedom."""
        lower, seen, chi2 = self.factor(scale)
        spread = np.sqrt((self.noise_dof + chi2) / chance)
        standard = solve_triangular(lower, seen[:, None] + spread * noise, lower=True, trans=1, check_finite=False)
        return scale[:, None] * standard, spread


@dataclass(frozen=True, eq=False)
class Known:
    """Weights of known scale integrated exactly: ``left`` holds the moments of the others.

    ``scale`` (known,), ``lower`` (known, known) is the factor of their precision and ``across`` (known, others + 1) what the
    others and the data share with them.
    """

    scale: np.ndarray
    lower: np.ndarray
    across: np.ndarray
    left: Moments

    @classmethod
    def of(cls, data: Moments, known, scale) -> Known:
        """Integrate the weights ``known`` (weights,) with standard deviations ``scale`` (known,) out of ``data``."""
        rest, rows = np.r_[~known, True], data.inner[:-1][known]
        lower = np.linalg.cholesky(np.eye(scale.size) + rows[:, :-1][:, known] * np.outer(scale, scale))
        across = solve_triangular(lower, scale[:, None] * rows[:, rest], lower=True, check_finite=False)
        left = data.inner[np.ix_(rest, rest)] - across.T @ across
        return cls(scale, lower, across, Moments(left, data.samples, data.noise_dof))

    def given(self, others, noise) -> np.ndarray:
        """Known weights (known, draws) for draws of the ``others`` (others, draws) and their own ``noise`` (known, draws)."""
        seen = self.across[:, -1:] - self.across[:, :-1] @ others + noise
        return self.scale[:, None] * solve_triangular(self.lower, seen, lower=True, trans=1, check_finite=False)


@dataclass(frozen=True, eq=False)
class Whitened:
    """Whitened columns ``x`` (samples, weights) and data ``y`` (samples,) with the number of independent samples.

    ``log_volume`` is what the whitening itself adds to the log marginal likelihood.
    """

    x: np.ndarray
    y: np.ndarray
    samples: float
    noise_dof: float
    log_volume: float = 0.0

    @cached_property
    def moments(self) -> Moments:
        """Inner products of columns and data."""
        both = np.column_stack([self.x, self.y])
        return Moments(both.T @ both, self.samples, self.noise_dof)

    @property
    def gram(self) -> np.ndarray:
        """Inner products of the columns, (weights, weights)."""
        return self.moments.inner[:-1, :-1]

    @property
    def moment(self) -> np.ndarray:
        """Inner products of the columns and the data, (weights,)."""
        return self.moments.inner[:-1, -1]

    @property
    def total(self) -> float:
        """Inner product of the data with themselves."""
        return float(self.moments.inner[-1, -1])

    def log_marginal(self, scale) -> np.ndarray:
        """Log marginal likelihoods (...) for standard deviations ``scale`` (..., weights), up to a constant."""
        return self.moments.log_marginal(scale)

    def solve(self, scale) -> Solution:
        """Posterior of the weights for standard deviations ``scale`` (weights,)."""
        lower, seen, chi2 = self.moments.factor(scale)
        root = scale[:, None] * dtrtri(lower, lower=1)[0].T
        dof = self.moments.dof
        log_marginal = -0.5 * dof * np.log1p(chi2 / self.noise_dof) - float(np.log(np.diag(lower)).sum())
        return Solution(root @ seen, root, chi2, (self.noise_dof + chi2) / dof, log_marginal)


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
    """Mode of the log scales by Newton steps with the exact Hessian, or ``sweeps`` steps towards it; the curvature is at least
    that of the widest prior."""
    log_scale = np.array(scales.mean if start is None else start, float)
    held = ~scales.free[scales.group]
    known, group = Known.of(data.moments, held, scales.of_weights(log_scale)[held]).left, scales.group[~held]
    # Weights of one scale stand side by side.
    first = np.flatnonzero(np.diff(group, prepend=-1))
    at = group[first]
    mean, precision = scales.mean[at], 1.0 / scales.sd[at] ** 2
    for _ in range(sweeps if at.size else 0):
        gradient, curvature = _slopes(known, scales.of_weights(log_scale)[~held], first)
        gradient -= precision * (log_scale[at] - mean)
        # A scale that is pressed against the end of its range stays there.
        end = np.where(gradient > 0, LOG_SCALES[1], LOG_SCALES[0])
        inside = np.abs(log_scale[at] - end) > SETTLED
        value, vector = np.linalg.eigh((curvature + np.diag(precision))[np.ix_(inside, inside)])
        step = vector @ (vector.T @ gradient[inside] / np.maximum(np.abs(value), precision.min()))
        step *= min(1.0, LONGEST_STEP / max(np.abs(step).max(initial=0.0), SETTLED))
        log_scale[at[inside]] = np.clip(log_scale[at[inside]] + step, *LOG_SCALES)
        if np.abs(step).max(initial=0.0) < SETTLED:
            break
    return log_scale, data.solve(scales.of_weights(log_scale))


def _slopes(moments: Moments, scale, first) -> tuple[np.ndarray, np.ndarray]:
    """Gradient (scales,) and negative Hessian (scales, scales) of the log marginal likelihood by the log scales of weights that
    stand side by side from the places ``first`` on.

    With M the covariance and m the mean of the weights over their ``scale``, dM/ds_j = -[M D_j (1 - M) + (1 - M) D_j M] and
    dm/ds_j = (2 M - 1) D_j m, D_j choosing the weights of scale j; the gradient is MacKay's (Neural Computation 4, 1992, 415).
    """
    lower, seen, chi2 = moments.factor(scale)
    mean = solve_triangular(lower, seen, lower=True, trans=1, check_finite=False)
    inverse = dpotri(lower, lower=1, overwrite_c=1)[0]  # its lower half, the other is zero
    own = np.diag(inverse)

    share = moments.dof / (moments.noise_dof + chi2)
    squares, left = np.add.reduceat(mean**2, first), np.add.reduceat(own, first)
    count = np.diff(first, append=scale.size)
    turned, square = _by_scales(inverse, mean, np.repeat(np.arange(first.size), count))
    bent = 4.0 * turned - 2.0 * np.diag(squares)
    hessian = share * bent + 2.0 * share**2 / moments.dof * np.outer(squares, squares)
    hessian -= 2.0 * (np.diag(left) - square)
    return share * squares - (count - left), -hessian


@numba.njit(cache=True)
def _by_scales(inverse, mean, scale):
    """Sums of M_ij m_i m_j and of M_ij^2 over the weights of two scales, both (scales, scales), for a symmetric M of which the
    lower half is given."""
    turned, square = np.zeros((scale[-1] + 1, scale[-1] + 1)), np.zeros((scale[-1] + 1, scale[-1] + 1))
    for j in range(mean.size):
        for i in range(j, mean.size):
            value = inverse[i, j]
            turned[scale[i], scale[j]] += value * mean[i] * mean[j]
            square[scale[i], scale[j]] += value * value
        turned[scale[j], scale[j]] -= 0.5 * inverse[j, j] * mean[j] ** 2
        square[scale[j], scale[j]] -= 0.5 * inverse[j, j] ** 2
    return turned + turned.T, square + square.T


def whiten(columns, angles, covariances, noise_dof: float, settled=None) -> Whitened:
    """Whiten records' columns (blocks, weights) and angles (blocks,) and take out each record's offset.

    Only ``settled`` blocks (blocks,) of each record count, by default all; the rows of others are zero.
    """
    settled = [np.ones(angle.size, bool) for angle in angles] if settled is None else settled
    found = [whiten_record(*record) for record in zip(columns, angles, covariances, settled, strict=True)]
    joined = np.concatenate([rows for rows, _ in found])
    samples = float(sum(own.sum() for own in settled) - len(found))
    return Whitened(joined[:, :-1], joined[:, -1], samples, noise_dof, float(sum(volume for _, volume in found)))


def whiten_record(columns, angle, covariance, settled) -> tuple[np.ndarray, float]:
    """Whitened columns and angle of one record, (blocks, weights + 1), and what that adds to the log marginal likelihood."""
    lower = np.linalg.cholesky(covariance[np.ix_(settled, settled)])
    both = np.column_stack([columns, angle, np.ones(angle.size)])[settled]
    both = solve_triangular(lower, both, lower=True, check_finite=False)
    length = np.linalg.norm(both[:, -1])
    one, rows = both[:, -1] / length, np.zeros((angle.size, both.shape[1] - 1))
    rows[settled] = both[:, :-1] - np.outer(one, one @ both[:, :-1])
    return rows, -float(np.log(np.diag(lower)).sum() + np.log(length))
