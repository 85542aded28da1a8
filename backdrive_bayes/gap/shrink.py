"""How far the gap shrinks on data left out of the fit once an effect is added, with a flexible control beside it.

Records are left out in turn, or cycles where there is one record. The fits without them are those of the model made linear at
its joint mode; the encoder's offset and the past of what is left out are taken from itself, before and after alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from backdrive_bayes.gap.hypotheses import Fitted
from backdrive_bayes.gap.setting import MISFIT_LENGTH, Setting

DRAWS = 200
SMALLEST_GAP = 0.2
MISFIT = ("misfit", MISFIT_LENGTH, 0.3)


@dataclass(frozen=True, eq=False)
class Shrink:
    """Mean square of what is left out [rad²] by fold: before, after and control (folds, draws), noise floor (folds,)."""

    names: tuple[str, ...]
    before: np.ndarray
    after: np.ndarray
    floor: np.ndarray
    control: np.ndarray


def shrink(setting: Setting, before: Fitted, after: Fitted, weight, rng) -> Shrink:
    """Predict every fold from the others; ``weight`` (blocks,) is the torque that a block spans."""
    folds = _folds(setting)
    rows = []
    for own in folds.values():
        floor = float(np.average(np.diag(setting.noise)[own], weights=weight[own]))
        lost = [_left_out(setting, fitted, own, weight, rng) for fitted in (before, after)]
        rows.append((*lost, floor, _control(setting, before, own, weight, rng)))
    return Shrink(tuple(folds), *(np.array([row[i] for row in rows]) for i in range(4)))


def _folds(setting):
    data = setting.problem.records
    if len(data) > 1:
        return {d.blocks.name: np.flatnonzero(setting.places.record == r) for r, d in enumerate(data)}
    # One record: its later whole legs in turn, the first leg is never left out.
    legs = data[0].blocks.leg
    return {f"leg {k + 1}": np.flatnonzero(legs == k) for k in range(1, legs.max() + 1)} or {"all": np.arange(legs.size)}


def _left_out(setting, fitted, own, weight, rng):
    """Mean square residual on ``own`` of draws fitted to the rest, shape (draws,)."""
    rest = np.setdiff1d(np.arange(setting.places.record.size), own)
    mean, factor = _posterior(setting, fitted, rest)
    z = mean + rng.standard_normal((DRAWS, mean.size)) @ factor.T
    residual = fitted.residual[own] + (z - fitted.z) @ fitted.jacobian[own].T
    nuisance = np.column_stack([np.ones(own.size), fitted.jacobian[np.ix_(own, _own_coordinates(setting, fitted, own))]])
    root = np.sqrt(weight[own] / weight[own].sum())
    basis = np.linalg.qr(nuisance * root[:, None])[0]
    residual = residual * root
    return np.sum((residual - (residual @ basis) @ basis.T) ** 2, axis=1)


def _own_coordinates(setting, fitted, own):
    record = set(setting.places.record[own]) if len(setting.problem.records) > 1 else set()
    return [i for i, c in enumerate(fitted.problem.coordinates) if c.record in record]


def _posterior(setting, fitted, rows):
    """Mean and a square root of the covariance of the coordinates given some blocks only."""
    lower = cholesky(setting.covariance(MISFIT)[np.ix_(rows, rows)], lower=True)
    ones = (setting.places.record[rows][:, None] == np.unique(setting.places.record[rows])).astype(float)
    white = solve_triangular(lower, np.column_stack([fitted.residual[rows], fitted.jacobian[rows], ones]), lower=True)
    basis = np.linalg.qr(white[:, fitted.z.size + 1 :])[0]
    white = white[:, : fitted.z.size + 1]
    white = white - basis @ (basis.T @ white)
    residual, jacobian = white[:, 0] - white[:, 1:] @ fitted.z, white[:, 1:]
    covariance = np.linalg.inv(np.eye(fitted.z.size) + jacobian.T @ jacobian)
    return -covariance @ (jacobian.T @ residual), np.linalg.cholesky(covariance + 1e-14 * np.eye(fitted.z.size))


def _control(setting, fitted, own, weight, rng):
    """Mean square residual when draws of a Gaussian process over the loop, fitted to the rest, predict ``own``, (draws,)."""
    rest = np.setdiff1d(np.arange(setting.places.record.size), own)
    kernel = setting.kernel("loop", MISFIT_LENGTH) * np.var(fitted.residual)
    factor = cho_factor(kernel[np.ix_(rest, rest)] + setting.noise[np.ix_(rest, rest)], lower=True)
    left = fitted.residual[rest] - _record_means(fitted.residual, setting.places.record)[rest]
    solved = cho_solve(factor, kernel[np.ix_(rest, own)])
    spread = kernel[np.ix_(own, own)] - kernel[np.ix_(own, rest)] @ solved
    lower = np.linalg.cholesky(spread + 1e-9 * np.trace(spread) / own.size * np.eye(own.size))
    residual = fitted.residual[own] - left @ solved - rng.standard_normal((DRAWS, own.size)) @ lower.T
    share = weight[own] / weight[own].sum()
    return ((residual - (residual @ share)[:, None]) ** 2) @ share


def _record_means(values, record):
    return (np.bincount(record, values) / np.bincount(record))[record]


def closed_fraction(before, after, floor) -> np.ndarray:
    """(rms before − rms after) / (rms before − noise floor), of mean squares [rad²], within −1 and 1.

    A gap of less than a fifth of the noise floor counts as that much: shares of nothing mean nothing.
    """
    gap = np.sqrt(before) - np.sqrt(floor)
    return np.clip((np.sqrt(before) - np.sqrt(after)) / np.maximum(gap, SMALLEST_GAP * np.sqrt(floor)), -1.0, 1.0)
