"""Correlated noise told apart from model discrepancy by the evidence of the residual.

Above some hertz the spectrum of the raw record fixes the noise; below, slow noise and smooth model error look alike, and a
smoother that removes the one removes the other. Here both are in one Gaussian covariance of the blocks, with the parameters'
directions marginalised, and the spectrum's estimate is the prior.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import minimize

from backdrive_bayes.inference.covariance import block_covariance
from backdrive_bayes.inference.discrepancy import Discrepancy, angle_jacobian, prior_deviation
from backdrive_bayes.inference.problem import Problem

RECORDS_USED = 3


def refine_noise(problem: Problem, z, discrepancy: Discrepancy, slopes):
    """Noise of every record with correlated level and correlation time refined on the longest records, and an extra
    standard deviation [N·m] of the torque path that the residuals on steep branches ask for.

    ``slopes`` holds dθ/dτ at the blocks of each record, shape (blocks,) each.
    """
    first = problem.records[0].noise
    longest = sorted(range(len(problem.records)), key=lambda r: -problem.records[r].blocks.end_s[-1])[:RECORDS_USED]
    terms = [_Term(problem, z, discrepancy, r, slopes[r]) for r in longest]
    centre = np.log([first.correlated_rad, first.correlation_time_s])
    width = np.array([
        [first.correlated_rad_sd / first.correlated_rad, 0.0],
        [0.0, first.correlation_time_s_sd / first.correlation_time_s],
    ])
    precision = np.linalg.inv(width @ _correlation(first) @ width)
    torque_scale = 1e-3 * problem.model.scale.torque_nm
    start = np.r_[centre, np.log(max(discrepancy.scale_rad, 1e-3 * first.correlated_rad)), np.log(0.1 * torque_scale)]

    def cost(theta):
        step = theta[:2] - centre
        path = 0.5 * (np.exp(theta[3]) / torque_scale) ** 2
        noise = replace(first, correlated_rad=float(np.exp(theta[0])), correlation_time_s=float(np.exp(theta[1])))
        return 0.5 * step @ precision @ step + path + sum(t.cost(noise, *np.exp(2 * theta[2:])) for t in terms)

    bounds = [(c - 2.5, c + 2.5) for c in start[:2]] + [(start[2] - 6, start[2] + 3), (start[3] - 3, start[3] + 5)]
    best = minimize(cost, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 25, "eps": 1e-3, "ftol": 1e-6})
    covariance = np.linalg.pinv(_curvature(cost, best.x), hermitian=True)[:2, :2]
    sd = np.sqrt(np.diag(covariance))
    correlated, correlation = (float(v) for v in np.exp(best.x[:2]))
    # Means over much longer than the correlation time have a variance in proportion to σ²t_c.
    dof = float(np.clip(2.0 / max(np.array([2.0, 1.0]) @ covariance @ [2.0, 1.0], 1e-9), 4.0, 1e5))
    refined = tuple(
        replace(
            d.noise,
            correlated_rad=correlated,
            correlation_time_s=correlation,
            correlated_rad_sd=correlated * float(sd[0]),
            correlation_time_s_sd=correlation * float(sd[1]),
            scale_dof=dof,
        )
        for d in problem.records
    )
    return refined, float(np.exp(best.x[3]))


def _correlation(noise):
    # Above the corner frequency the spectrum only knows σ²/t_c, so its errors rise and fall together.
    weak = min(noise.correlation_time_s_sd / noise.correlation_time_s, 1.0)
    rho = 0.98 * weak
    return np.array([[1.0, rho], [rho, 1.0]])


class _Term:
    """Negative log evidence of one record's residual as a function of noise and discrepancy variance."""

    def __init__(self, problem, z, discrepancy, record, slope):
        self.data, self.slope = problem.records[record], slope
        jacobian = angle_jacobian(problem, z, record, self.data.path)
        residual = self.data.blocks.angle_rad - problem.model.angle(problem.values(z, record), self.data.path)
        self.residual = residual - residual.mean()
        basis = discrepancy.raw_basis(record, self.data.path)
        deviation = prior_deviation(discrepancy.length, discrepancy.roughness)
        self.rough = (basis * deviation) @ (basis * deviation).T * discrepancy.relative[record] ** 2
        self.fixed = jacobian @ jacobian.T + np.ptp(self.data.blocks.angle_rad) ** 2

    def cost(self, noise, variance, path_variance):
        covariance = block_covariance(self.data.blocks, noise, self.slope) + self.fixed + variance * self.rough
        covariance[np.diag_indices_from(covariance)] += self.slope**2 * path_variance
        lower = cholesky(covariance, lower=True, check_finite=False)
        white = solve_triangular(lower, self.residual, lower=True, check_finite=False)
        return 0.5 * white @ white + np.log(np.diag(lower)).sum()


def _curvature(function, x, h=0.03):
    n = x.size
    unit = h * np.eye(n)
    value = np.empty((n, n))
    for i in range(n):
        for j in range(i + 1):
            plus = function(x + unit[i] + unit[j]) + function(x - unit[i] - unit[j])
            minus = function(x + unit[i] - unit[j]) + function(x - unit[i] + unit[j])
            value[i, j] = value[j, i] = (plus - minus) / (4 * h * h)
    w, v = np.linalg.eigh(value)
    return (v * np.maximum(w, 0.5)) @ v.T
