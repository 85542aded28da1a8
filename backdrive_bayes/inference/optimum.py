"""Posterior mode and its Gaussian (Laplace) approximation, from many starts at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from backdrive_bayes.inference.problem import Problem

STEP = 1e-4
DAMPINGS = np.array([0.01, 0.1, 1.0, 10.0, 100.0, 1e4])
LONGEST_STEP = 2.0
"""In prior standard deviations, for any coordinate."""
ENOUGH = 1e-3
"""Log posterior that a climb must gain in one of two steps to go on."""


@dataclass(frozen=True, eq=False)
class Optimum:
    """Posterior mode ``z`` (dimension,), its ``covariance``, whitened ``jacobian`` (blocks, dimension), noise ``scale2``."""

    z: np.ndarray
    covariance: np.ndarray
    jacobian: np.ndarray
    scale2: float
    log_posterior: float


def find_optimum(problem: Problem, starts, max_steps: int = 80, first_steps: int = 12, finalists: int = 2) -> Optimum:
    """Best posterior mode found by Levenberg-Marquardt from ``starts`` (starts, dimension).

    All starts climb ``first_steps`` together, the best ``finalists`` of them to the end.
    """
    return laplace(problem, best_mode(problem, starts, (first_steps, max_steps), finalists))


def best_mode(problem: Problem, starts, steps: tuple[int, int], finalists: int, enough: float = ENOUGH) -> np.ndarray:
    """The same without the approximation, shape (dimension,); ``steps`` are the first steps and those of the finalists."""
    z, value = climb(problem, np.atleast_2d(starts), steps[0], enough)
    z, value = climb(problem, z[np.argsort(-value)[:finalists]], steps[1], enough)
    return z[np.argmax(value)]


def laplace(problem: Problem, z) -> Optimum:
    """Gaussian approximation of the posterior at ``z``."""
    n = z.size
    probes = np.concatenate([z[None], z + STEP * np.eye(n), z - STEP * np.eye(n)])
    whitened = np.concatenate(problem.residuals(probes), axis=-1)
    jacobian = (whitened[1 : n + 1] - whitened[n + 1 :]).T / (2 * STEP)
    scale2 = float(_scale2(problem, whitened[:1])[0])
    normal = np.eye(n) + jacobian.T @ jacobian / scale2
    covariance = cho_solve(cho_factor(normal), np.eye(n))
    return Optimum(z, covariance, jacobian, scale2, float(problem.log_posterior(z)[0]))


def _scale2(problem, residual):
    """Noise variance factor at whitened residuals (starts, blocks), shape (starts,)."""
    chi2 = np.maximum(np.einsum("si,si->s", residual, residual) - problem.misfit, 0.0)
    return (problem.noise_dof + chi2) / (problem.noise_dof + problem.dof)


def climb(problem: Problem, starts, max_steps: int, enough: float = ENOUGH):
    """Levenberg-Marquardt from ``starts`` (starts, dimension), all at once: where they end, and the log posterior there.

    It is that of the reweighted least squares whose fixed point is the mode of the Student-t posterior.
    """
    z = np.array(starts, float)
    value, damping, stale = problem.log_posterior(z), np.full(len(z), 1e-2), np.zeros(len(z), int)
    for _ in range(max_steps):
        active = np.flatnonzero(stale < 2)
        if not active.size:
            break
        step, trial = _steps(problem, z[active], damping[active])
        values = problem.log_posterior((z[active, None] + step).reshape(-1, z.shape[1])).reshape(step.shape[:2])
        for row, i in enumerate(active):
            k = int(np.argmax(values[row]))
            gain = values[row, k] - value[i]
            if gain > 0:
                z[i], value[i] = z[i] + step[row, k], values[row, k]
            damping[i] = np.clip(trial[row, k] if gain > 0 else damping[i] * 100, 1e-8, 1e8)
            stale[i] = stale[i] + 1 if gain < enough else 0
    return z, value


def _steps(problem, z, damping):
    """Steps (starts, trials, dimension) under several dampings (starts, trials) each; the best sets the next damping."""
    n = z.shape[1]
    probes = np.concatenate([z[:, None], z[:, None] + STEP * np.eye(n)], axis=1)
    whitened = np.concatenate(problem.residuals(probes), axis=-1)
    residual, jacobian = whitened[:, 0], (whitened[:, 1:] - whitened[:, :1]) / STEP
    scale2 = _scale2(problem, residual)
    normal = np.eye(n) + np.matmul(jacobian, jacobian.swapaxes(1, 2)) / scale2[:, None, None]
    gradient = -z - np.matmul(jacobian, residual[:, :, None])[:, :, 0] / scale2[:, None]
    trial = damping[:, None] * DAMPINGS
    diagonal = np.einsum("sii->si", normal)[:, :, None] * np.eye(n)
    damped = normal[:, None] + trial[:, :, None, None] * diagonal[:, None]
    step = np.linalg.solve(damped, np.broadcast_to(gradient[:, None, :, None], (*trial.shape, n, 1)))[..., 0]
    return step * np.minimum(1.0, LONGEST_STEP / np.abs(step).max(axis=-1, keepdims=True)), trial
