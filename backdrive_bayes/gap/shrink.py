"""How far the gap shrinks on data left out of the fit once an effect is added, with a flexible control beside it.

Records are left out in turn, or legs where there is one record. What the parameters' mode given the rest foretells is compared,
without and with the effect. What belongs to a left-out record alone no other tells (the encoder's offset, the loop's past, a
wave's phase, its own drift): it is fitted to that record under its prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, solve_triangular

from backdrive_bayes.gap.draws import Z_BOUND
from backdrive_bayes.gap.hypotheses import ENOUGH, PROBE, Fitted
from backdrive_bayes.gap.setting import MISFIT_LENGTH, Setting

MOST_STEPS = 30
SHORTENED = np.array([0.0, 0.05, 0.25, 0.5, 1.0])
"""Lengths at which a Gauss-Newton step is tried."""
RESAMPLED = 400
FEWEST_PIECES = 4
SMALLEST_GAP = 0.2
MISFIT = ("misfit", MISFIT_LENGTH, 0.3)


@dataclass(frozen=True, eq=False)
class Shrink:
    """What is left out, piece by piece (up to four of a leg, by the torque), arrays of shape (pieces,).

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
        """Closed fraction of ``after`` or ``control``, and its central interval where other data would have been left out.

        The interval is that of a Bayesian bootstrap over folds and their pieces (Rubin, Annals of Statistics 9, 1981); of fewer
        than ``FEWEST_PIECES`` pieces there is none: both ends are the value itself.
        """
        own = np.full(self.fold.size, True) if fold is None else self.fold == fold
        folds, number = np.unique(self.fold[own], return_inverse=True)
        weight = rng.standard_exponential((RESAMPLED, number.size))
        if folds.size > 1:
            weight *= rng.standard_exponential((RESAMPLED, folds.size))[:, number]
        weight = np.concatenate([np.ones((1, number.size)), weight])
        share = weight @ self.share[own]
        fraction = closed_fraction(*(weight @ getattr(self, name)[own] / share for name in ("before", part, "floor")))
        middle = float(fraction[0])
        if number.size < FEWEST_PIECES:
            return {"median": middle, "lo": middle, "hi": middle}
        lo, hi = np.quantile(fraction, [0.5 - level / 2, 0.5 + level / 2])
        return {"median": middle, "lo": min(float(lo), middle), "hi": max(float(hi), middle)}


def shrink(setting: Setting, before: Fitted, after: Fitted, weight) -> Shrink:
    """Predict every fold from the others; ``weight`` (blocks,) is the torque that a block spans."""
    torque = np.concatenate([d.blocks.torque_nm for d in setting.problem.records])
    leg = np.concatenate([d.blocks.leg for d in setting.problem.records])
    columns = []
    for number, own in enumerate(_folds(setting).values()):
        share = weight[own] / weight[own].sum()
        place = np.floor(2 * torque[own] / np.abs(torque[own]).max()).astype(int)
        piece = np.unique(np.stack([leg[own], place]), axis=1, return_inverse=True)[1]
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
    """Squared residual on ``own`` of what the rest foretells, times the blocks' shares, shape (own blocks,)."""
    record, problem = setting.places.record, fitted.problem
    gone = set(record[own]) - set(record[np.setdiff1d(np.arange(record.size), own)])
    of_own = np.array([c.record in gone for c in problem.coordinates])
    z = _climbed(setting, problem, fitted.z, np.flatnonzero(~of_own), np.setdiff1d(np.arange(record.size), own))
    if of_own.any():
        z = _climbed(setting, problem, z, np.flatnonzero(of_own), own)
    residual = problem.raw_residual(z[None])[0, own]
    return share * (residual - residual @ share) ** 2


def _climbed(setting, problem, z, free, rows):
    """Coordinates at the mode of the ``free`` ones given some blocks only, the others held."""
    record = setting.places.record[rows]
    lower = cholesky(setting.covariance(MISFIT)[np.ix_(rows, rows)], lower=True)
    basis = np.linalg.qr(solve_triangular(lower, (record[:, None] == np.unique(record)).astype(float), lower=True))[0]

    def white(points):
        values = solve_triangular(lower, problem.raw_residual(points)[:, rows].T, lower=True)
        return values - basis @ (basis.T @ values)

    probe = PROBE * np.eye(z.size)[free]
    for _ in range(MOST_STEPS):
        near = white(np.concatenate([z[None], z + probe, z - probe]))
        residual, jacobian = near[:, 0], (near[:, 1 : free.size + 1] - near[:, free.size + 1 :]) / (2 * PROBE)
        step = np.zeros(z.size)
        step[free] = -np.linalg.solve(np.eye(free.size) + jacobian.T @ jacobian, jacobian.T @ residual + z[free])
        tried = np.clip(z + SHORTENED[:, None] * step, -Z_BOUND, Z_BOUND)
        cost = 0.5 * (np.sum(white(tried) ** 2, axis=0) + np.sum(tried**2, axis=1))
        z = tried[int(np.argmin(cost))]
        if cost[0] - cost.min() < ENOUGH:
            break
    return z


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
