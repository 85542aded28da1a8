"""How far the gap shrinks on data left out of the fit once an effect is added, with a flexible control beside it.

Records are left out in turn, or legs where there is one record. What is compared is the prediction by the parameters' mode given
the rest; the encoder's offset and the past of what is left out are taken from itself, before and after alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from backdrive_bayes.gap.draws import Z_BOUND
from backdrive_bayes.gap.hypotheses import Fitted, linearised
from backdrive_bayes.gap.setting import MISFIT_LENGTH, Setting

STEPS = 4
RESAMPLED = 400
SMALLEST_GAP = 0.2
MISFIT = ("misfit", MISFIT_LENGTH, 0.3)


@dataclass(frozen=True, eq=False)
class Shrink:
    """What is left out, piece by piece (half legs), arrays of shape (pieces,).

    ``fold`` numbers the fold of each piece, ``share`` is its part of the fold's torque; ``before``, ``after``, ``control`` and
    ``floor`` are its parts of the fold's mean square [rad²]: residuals without and with the effect and of the control, and noise.
    """

    names: tuple[str, ...]
    fold: np.ndarray
    share: np.ndarray
    before: np.ndarray
    after: np.ndarray
    control: np.ndarray
    floor: np.ndarray

    def mean_square(self, part: str, fold: int | None = None) -> float:
        """Mean square [rad²] of one part in one fold, or over all of them."""
        own = np.full(self.fold.size, True) if fold is None else self.fold == fold
        return float(getattr(self, part)[own].sum() / self.share[own].sum())

    def closed(self, part: str, rng, level: float, fold: int | None = None) -> dict:
        """Closed fraction of ``after`` or ``control``, and its central interval where other pieces would have been left out.

        The interval is that of a Bayesian bootstrap over pieces (Rubin, Annals of Statistics 9, 1981).
        """
        own = np.full(self.fold.size, True) if fold is None else self.fold == fold
        weight = np.concatenate([np.ones((1, own.sum())), rng.standard_exponential((RESAMPLED, own.sum()))])
        share = weight @ self.share[own]
        fraction = closed_fraction(*(weight @ getattr(self, name)[own] / share for name in ("before", part, "floor")))
        lo, hi = np.quantile(fraction, [0.5 - level / 2, 0.5 + level / 2])
        middle = float(fraction[0])
        return {"median": middle, "lo": min(float(lo), middle), "hi": max(float(hi), middle)}


def shrink(setting: Setting, before: Fitted, after: Fitted, weight) -> Shrink:
    """Predict every fold from the others; ``weight`` (blocks,) is the torque that a block spans."""
    torque = np.concatenate([d.blocks.torque_nm for d in setting.problem.records])
    leg = np.concatenate([d.blocks.leg for d in setting.problem.records])
    columns = []
    for number, own in enumerate(_folds(setting).values()):
        share = weight[own] / weight[own].sum()
        piece = np.unique(np.stack([setting.places.record[own], leg[own], torque[own] > 0]), axis=1, return_inverse=True)[1]
        squares = (*(_left_out(setting, f, own, share) for f in (before, after)), _control(setting, before, own, share))
        parts = (share, *squares, share * np.diag(setting.noise)[own])
        sums = np.array([np.bincount(piece.ravel(), p) for p in parts])
        columns.append(np.concatenate([np.full((1, sums.shape[1]), number), sums]))
    fold, *rest = np.concatenate(columns, axis=1)
    return Shrink(tuple(_folds(setting)), fold, *rest)


def _folds(setting):
    data = setting.problem.records
    if len(data) > 1:
        return {d.blocks.name: np.flatnonzero(setting.places.record == r) for r, d in enumerate(data)}
    # One record: its later whole legs in turn, the first leg is never left out.
    legs = data[0].blocks.leg
    return {f"leg {k + 1}": np.flatnonzero(legs == k) for k in range(1, legs.max() + 1)} or {"all": np.arange(legs.size)}


def _left_out(setting, fitted, own, share):
    """Squared residual on ``own`` of what the rest predicts, times the blocks' shares, shape (own blocks,)."""
    mode = _mode(setting, fitted, np.setdiff1d(np.arange(setting.places.record.size), own))
    nuisance = np.column_stack([np.ones(own.size), mode.jacobian[np.ix_(own, _own_coordinates(setting, mode, own))]])
    root = np.sqrt(share)
    basis = np.linalg.qr(nuisance * root[:, None])[0]
    residual = mode.residual[own] * root
    return (residual - basis @ (basis.T @ residual)) ** 2


def _own_coordinates(setting, fitted, own):
    record = set(setting.places.record[own]) if len(setting.problem.records) > 1 else set()
    return [i for i, c in enumerate(fitted.problem.coordinates) if c.record in record]


def _mode(setting, fitted, rows):
    """The hypothesis at its mode given some blocks only, by a few Gauss-Newton steps from its joint mode."""
    lower = cholesky(setting.covariance(MISFIT)[np.ix_(rows, rows)], lower=True)
    ones = (setting.places.record[rows][:, None] == np.unique(setting.places.record[rows])).astype(float)
    basis = np.linalg.qr(solve_triangular(lower, ones, lower=True))[0]

    def white(values):
        values = solve_triangular(lower, values[rows], lower=True)
        return values - basis @ (basis.T @ values)

    def cost(z):
        left = white(fitted.problem.raw_residual(z).T)
        return np.sum(left**2, axis=0) + np.sum(z**2, axis=1)

    for _ in range(STEPS):
        residual, jacobian = white(fitted.residual), white(fitted.jacobian)
        normal = np.eye(fitted.z.size) + jacobian.T @ jacobian
        step = -np.linalg.solve(normal, jacobian.T @ residual + fitted.z)
        tried = np.clip(fitted.z + np.array([[0.0], [0.25], [0.5], [1.0]]) * step, -Z_BOUND, Z_BOUND)
        best = tried[int(np.argmin(cost(tried)))]
        fitted = linearised(fitted.problem, fitted.effects, best)
    return fitted


def _control(setting, fitted, own, share):
    """The same of a Gaussian process over the loop that was fitted to the rest of the baseline's residual, (own blocks,)."""
    rest = np.setdiff1d(np.arange(setting.places.record.size), own)
    kernel = setting.kernel("loop", MISFIT_LENGTH) * np.var(fitted.residual)
    factor = cho_factor(kernel[np.ix_(rest, rest)] + setting.noise[np.ix_(rest, rest)], lower=True)
    left = fitted.residual[rest] - _record_means(fitted.residual, setting.places.record)[rest]
    residual = fitted.residual[own] - kernel[np.ix_(own, rest)] @ cho_solve(factor, left)
    return share * (residual - residual @ share) ** 2


def _record_means(values, record):
    return (np.bincount(record, values) / np.bincount(record))[record]


def closed_fraction(before, after, floor) -> np.ndarray:
    """(rms before − rms after) / (rms before − noise floor), of mean squares [rad²], within −1 and 1.

    A gap of less than a fifth of the noise floor counts as that much: shares of nothing mean nothing.
    """
    gap = np.sqrt(before) - np.sqrt(floor)
    return np.clip((np.sqrt(before) - np.sqrt(after)) / np.maximum(gap, SMALLEST_GAP * np.sqrt(floor)), -1.0, 1.0)
