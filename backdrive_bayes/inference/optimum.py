"""Posterior mode and its Gaussian (Laplace) approximation, from many starts at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from backdrive_bayes.inference.problem import Problem

STEP = 1e-4


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

    All starts climb ``first_steps``, the best ``finalists`` of them to the end.
    """
    climbed = sorted((_climb(problem, z, first_steps) for z in starts), key=lambda pair: -pair[1])
    best = max((_climb(problem, z, max_steps) for z, _ in climbed[:finalists]), key=lambda pair: pair[1])
    return laplace(problem, best[0])


def laplace(problem: Problem, z) -> Optimum:
    """Gaussian approximation of the posterior at ``z``."""
    residual, jacobian, scale2 = _linearise(problem, z)
    normal = np.eye(problem.dimension) + jacobian.T @ jacobian / scale2
    covariance = cho_solve(cho_factor(normal), np.eye(problem.dimension))
    return Optimum(z, covariance, jacobian, scale2, float(problem.log_posterior(z)[0]))


def _linearise(problem, z):
    """Whitened residual (blocks,), its Jacobian (blocks, dimension), and the noise variance factor at ``z``."""
    n = problem.dimension
    probes = np.concatenate([z[None], z + STEP * np.eye(n), z - STEP * np.eye(n)])
    whitened = np.concatenate(problem.residuals(probes), axis=-1)
    residual, jacobian = whitened[0], (whitened[1 : n + 1] - whitened[n + 1 :]).T / (2 * STEP)
    chi2 = max(float(residual @ residual) - problem.misfit, 0.0)
    return residual, jacobian, (problem.noise_dof + chi2) / (problem.noise_dof + problem.dof)


def _climb(problem, z, max_steps):
    """Levenberg-Marquardt on the reweighted least squares whose fixed point is the Student-t posterior mode."""
    value, damping = float(problem.log_posterior(z)[0]), 1e-2
    stale = 0
    for _ in range(max_steps):
        residual, jacobian, scale2 = _linearise(problem, z)
        normal = np.eye(z.size) + jacobian.T @ jacobian / scale2
        gradient = -z - jacobian.T @ residual / scale2
        # One batch of damped steps: the best of them sets the damping of the next.
        trial = damping * np.array([0.01, 0.1, 1.0, 10.0, 100.0, 1e4])
        diagonal = np.diag(np.diag(normal))
        steps = np.array([np.linalg.solve(normal + t * diagonal, gradient) for t in trial])
        steps *= np.minimum(1.0, 2.0 / np.abs(steps).max(axis=1))[:, None]
        values = problem.log_posterior(z + steps)
        k = int(np.argmax(values))
        gain = values[k] - value
        if gain > 0:
            z, value = z + steps[k], float(values[k])
        damping = float(np.clip(trial[k] if gain > 0 else damping * 100, 1e-8, 1e8))
        stale = stale + 1 if gain < 1e-3 else 0
        if stale >= 2:
            break
    return z, value
