"""Log evidence of a fitted hypothesis: parameters, encoder offsets and the scale of the noise integrated.

Noise, the baseline's small misfit and the error of the effects' own formulas are in one covariance, so that neither a flexible
effect nor a second one is credited with what an approximate formula leaves.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from backdrive_bayes.gap.hypotheses import Fitted
from backdrive_bayes.gap.setting import Setting

FORMULA_ERRORS = (0.03, 0.15, 0.6)
"""Standard deviations by which an effect's contribution may differ from its formula, relative to the contribution."""
FORMULA_LENGTH = 0.06
DRIFT_LENGTH = 0.15
"""Correlation length of the error of a formula for the time, in records."""


def log_evidence(setting: Setting, fitted: Fitted, *terms) -> np.ndarray:
    """Gaussian integral over the parameters of the model made linear at its mode, offsets under a flat prior.

    ``terms`` are (kernel name, length, standard deviation in noise units) each, beside noise and formula error. One value for
    each of ``FORMULA_ERRORS``, all alike where there is no effect.
    """
    base = setting.covariance(*terms)
    if not fitted.contributions:
        return np.full(len(FORMULA_ERRORS), _gaussian(setting, fitted, base))
    shape = formula_error(setting, fitted)
    return np.array([_gaussian(setting, fitted, base + level**2 * shape) for level in FORMULA_ERRORS])


def _gaussian(setting, fitted, covariance):
    lower = cholesky(covariance, lower=True, check_finite=False, overwrite_a=True)
    record = setting.places.record
    ones = (record[:, None] == np.arange(record.max() + 1)).astype(float)
    right = np.column_stack([fitted.residual, fitted.jacobian, ones])
    white = solve_triangular(lower, right, lower=True, check_finite=False, overwrite_b=True)
    n = fitted.z.size
    basis, upper = np.linalg.qr(white[:, n + 1 :])
    white = white[:, : n + 1] - basis @ (basis.T @ white[:, : n + 1])
    log_norm = -np.log(np.diag(lower)).sum() - np.log(np.abs(np.diag(upper))).sum()
    return float(log_norm + _integrated(fitted, white[:, 0], white[:, 1:]))


def formula_error(setting: Setting, fitted: Fitted) -> np.ndarray:
    """Covariance (blocks, blocks) of the error of the effects' formulas, relative to their contributions.

    It varies with the place on the loop, for an effect of the time alone with the time, as large as the effect in each record.
    """
    record, total = setting.places.record, 0.0
    of_time = {m.name for m in fitted.problem.model.members if getattr(m, "of_time", False)}
    for name, change in zip(fitted.effects, fitted.contributions, strict=True):
        if name in of_time:
            change = np.sqrt(np.bincount(record, change**2) / np.bincount(record))[record]
        kernel = ("time_alone", DRIFT_LENGTH) if name in of_time else ("shape", FORMULA_LENGTH)
        total = total + np.outer(change, change) * setting.kernel(*kernel)
    return total


def _integrated(fitted, residual, jacobian):
    # residual(z) ≈ residual + jacobian (z - mode), the jacobian being the residual's derivative.
    residual = residual - jacobian @ fitted.z
    normal = np.eye(fitted.z.size) + jacobian.T @ jacobian
    z = -np.linalg.solve(normal, jacobian.T @ residual)
    left = residual + jacobian @ z
    chi2 = left @ left + z @ z
    nu, n = fitted.problem.noise_dof, fitted.problem.dof
    return -0.5 * (nu + n) * np.log1p(chi2 / nu) - 0.5 * np.linalg.slogdet(normal)[1]
