"""How far the gap shrinks on data left out of the fit once an effect is added, with a control that names no cause beside it.

Records are held out in turn, or legs where there is one record. Weights are those of the rest; what belongs to the
held-out record
alone (its offset, drift, a creep in progress) is fitted to it under its prior, for no other record tells it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from backdrive_bayes.engine.design import histories
from backdrive_bayes.engine.levels import learn_scales
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import whiten
from backdrive_bayes.indicators.same_loop import SAME_AMPLITUDE, same_amplitude, same_rate
from backdrive_bayes.mechanics.effect import Distortion, PathEffect

RESAMPLED = 400
FEWEST_PIECES = 4
SMALLEST_GAP = 0.2
"""A gap of less than this share of the noise floor counts as that much: shares of nothing mean nothing."""


@dataclass(frozen=True, eq=False)
class Fitted:
    """A hypothesis ready for prediction: the linear model about its mode, scales and means of its weights, (weights,), and a root
    of their covariance, (weights, weights)."""

    effects: tuple[str, ...]
    linear: Linear
    scale: np.ndarray
    mean: np.ndarray
    root: np.ndarray

    @property
    def residual(self) -> list[np.ndarray]:
        """What it leaves at the blocks of each record, in shares of the angle scale."""
        curves = self.linear.design.predict(self.linear.design.split(self.mean))
        return [a - c for a, c in zip(self.linear.angles, curves, strict=True)]


def fit_hypothesis(linear: Linear, effects, priors) -> Fitted:
    """Scales and weights of a hypothesis on all records."""
    scales, log_scale, solution = learn_scales(linear, priors)
    root = solution.root * np.sqrt(solution.variance)
    return Fitted(tuple(effects), linear, scales.of_weights(log_scale), solution.mean, root)


@dataclass(frozen=True, eq=False)
class Shrink:
    """What is held out, piece by piece, arrays of shape (pieces,).

    ``fold`` numbers the fold of each piece, ``share`` is its part of the fold's torque; ``before``, ``after``,
    ``control`` and ``floor`` are its parts of the fold's mean square [rad²]: residuals without and with the effect and of the
    control, and noise. ``error`` (1 + resamples, pieces) is what a right model's prediction from the other folds may add to the
    noise, its mean first.
    """

    names: tuple[str, ...]
    fold: np.ndarray
    share: np.ndarray
    before: np.ndarray
    after: np.ndarray
    control: np.ndarray
    floor: np.ndarray
    error: np.ndarray

    def mean_square(self, part: str, folds=None) -> float:
        """Mean square [rad²] of one part in one fold or several, or over all of them."""
        own = self._pieces(folds)
        return float(getattr(self, part)[own].sum() / max(self.share[own].sum(), 1e-300))

    def clear_of_noise(self, folds=None) -> float:
        """Mean square of what the model leaves without the effect, in that of the noise, of one fold, several or all."""
        return self.mean_square("before", folds) / max(self.mean_square("floor", folds), 1e-300)

    def closed(self, part: str, rng, level: float, folds=None) -> dict:
        """Closed fraction of ``after`` or ``control`` with its central interval by a Bayesian bootstrap over folds and pieces, in
        which a right model's error of prediction is drawn too.

        Source: Rubin, Annals of Statistics 9, 1981. Of fewer than ``FEWEST_PIECES`` pieces there is none: both ends
        are the value.
        """
        own = self._pieces(folds)
        weight = resampled(self.fold[own], rng)
        share = weight @ self.share[own]
        before, left, floor = (weight @ getattr(self, name)[own] / share for name in ("before", part, "floor"))
        floor = floor + np.sum(weight * self.error[:, own], axis=1) / share
        fraction = closed_fraction(before, left, floor)
        return about_first(fraction, level, weight.shape[1])

    def _pieces(self, folds):
        return np.full(self.fold.size, True) if folds is None else np.isin(self.fold, folds)


def resampled(fold, rng) -> np.ndarray:
    """Weights of a Bayesian bootstrap over folds and pieces, (resamples, pieces), all one in the first row."""
    folds, number = np.unique(fold, return_inverse=True)
    weight = rng.standard_exponential((RESAMPLED, number.size))
    if folds.size > 1:
        weight *= rng.standard_exponential((RESAMPLED, folds.size))[:, number]
    return np.concatenate([np.ones((1, number.size)), weight])


def about_first(values, level: float, pieces: int) -> dict:
    """The first value with the central interval of all of them, which is that value where the pieces are too few."""
    middle = float(values[0])
    if pieces < FEWEST_PIECES:
        return {"median": middle, "lo": middle, "hi": middle}
    lo, hi = np.quantile(values, [0.5 - level / 2, 0.5 + level / 2])
    return {"median": middle, "lo": min(float(lo), middle), "hi": max(float(hi), middle)}


def shrink(before: Fitted, after: Fitted, weight, rng) -> Shrink:
    """Predict every fold from the others; ``weight`` holds the torque that each block spans, by record."""
    linear = after.linear
    folds = _folds(linear)
    record = np.repeat(np.arange(len(linear.angles)), [a.size for a in linear.angles])
    torque = np.concatenate([b.torque_nm for b in linear.reduced.blocks])
    leg = np.concatenate([b.leg for b in linear.reduced.blocks])
    span, scale = np.concatenate(weight), linear.reduced.angle_scale_rad
    variance = np.concatenate([np.diag(c) for c in linear.covariances]) * scale**2
    columns, errors = [], []
    for number, own in enumerate(folds.values()):
        share = span[own] / span[own].sum()
        (without, _), (with_effect, wide) = (_held_out(f, own, record) for f in (before, after))
        residuals = [r * scale for r in (without, with_effect, without - _control(before, own, record))]
        error = (wide - share @ wide) @ rng.standard_normal((wide.shape[1], RESAMPLED)) * scale
        half = np.minimum((2 * np.abs(torque[own]) / np.abs(torque[own]).max()).astype(int), 1)
        place = np.where(torque[own] < 0, -1 - half, half)
        piece = np.unique(np.stack([leg[own], place]), axis=1, return_inverse=True)[1].ravel()
        parts = (share, *(share * (r - r @ share) ** 2 for r in residuals), share * variance[own])
        sums = np.array([np.bincount(piece, p) for p in parts])
        columns.append(np.concatenate([np.full((1, sums.shape[1]), number), sums]))
        drawn = np.array([np.bincount(piece, share * e**2) for e in error.T])
        errors.append(np.concatenate([drawn.mean(axis=0, keepdims=True), drawn]))
    fold, share, without, added, control, floor = np.concatenate(columns, axis=1)
    return Shrink(tuple(folds), fold, share, without, added, control, floor, np.concatenate(errors, axis=1))


def _folds(linear):
    """Rows of each fold by name: records, or later whole legs of a single one."""
    sizes = [a.size for a in linear.angles]
    ends = np.cumsum([0, *sizes])
    blocks = linear.reduced.blocks
    if len(sizes) > 1:
        return {b.name: np.arange(a, z) for b, a, z in zip(blocks, ends[:-1], ends[1:], strict=True)}
    legs = blocks[0].leg
    settled = np.unique(legs[linear.reduced.settled[0]])
    # A fold needs others to be predicted from.
    return {f"leg {k + 1}": np.flatnonzero(legs == k) for k in settled} if settled.size > 1 else {"all": np.arange(legs.size)}


def within_reach(linear: Linear) -> list[int]:
    """Folds that the others predict without extrapolating: some other record is as slow, some as fast and some as large; of the
    legs of a single record, some other goes the same way between torques as far apart (from a leg back the class knows the one
    forth only by its symmetry)."""
    rate = linear.reduced.context.rate
    if rate.size == 1:
        return _repeated_legs(linear.reduced.blocks[0], linear.reduced.settled[0])
    largest, found = np.array([np.abs(b.turning_nm).max() for b in linear.reduced.blocks]), []
    for k in range(rate.size):
        others = np.delete(np.arange(rate.size), k)
        slower, faster = (any(same_rate(rate[o], rate[k]) or f(rate[o], rate[k]) for o in others) for f in (np.less, np.greater))
        larger = any(same_amplitude(largest[o], largest[k]) or largest[o] > largest[k] for o in others)
        if slower and faster and larger:
            found.append(k)
    return found


def _repeated_legs(blocks, settled) -> list[int]:
    """Numbers, among the settled legs of a record, of those that another one runs over as well, in the same direction."""
    legs = np.unique(blocks.leg[settled])
    begin, end = blocks.direction[legs] * blocks.turning_nm[legs], blocks.direction[legs] * blocks.turning_nm[legs + 1]
    slack = SAME_AMPLITUDE * np.abs(blocks.turning_nm).max()
    over = (begin <= begin[:, None] + slack) & (end >= end[:, None] - slack)
    same = blocks.direction[legs] == blocks.direction[legs, None]
    return np.flatnonzero(np.sum(over & same, axis=1) > 1).tolist()


def _held_out(fitted: Fitted, own, record) -> tuple[np.ndarray, np.ndarray]:
    """Residual (own blocks,) of what the rest predicts, what belongs to the held-out record alone fitted to it, and a root of
    that prediction's covariance (own blocks, weights)."""
    linear, design = fitted.linear, fitted.linear.design
    columns, angle = np.vstack(design.records()), np.concatenate(linear.angles)[:, None]
    rest = np.setdiff1d(np.arange(record.size), own)
    gone = np.setdiff1d(record[own], record[rest])
    alone = _alone(linear, int(gone[0])) if gone.size else np.full(columns.shape[1], False)
    left, used = angle[own], ~alone
    if rest.size:
        weights, root = _ridge(linear, columns, angle, rest, record, fitted.scale, used)
        left = np.column_stack([left - columns[own][:, used] @ weights, columns[own][:, used] @ root])
    if gone.size:
        spread = np.zeros((record.size, left.shape[1]))
        spread[own] = left
        left = left - columns[own][:, alone] @ _ridge(linear, columns, spread, own, record, fitted.scale, alone)[0]
    return left[:, 0], left[:, 1:]


def _alone(linear: Linear, record: int) -> np.ndarray:
    """Which weights belong to one record alone, (weights,): those whose columns a path that was not measured lacks."""
    history, effects = histories(linear.reduced, Distortion())[record], {e.name: e for e in linear.effects}
    found = []
    for group in linear.design.groups:
        if group.own:
            found += [np.full(c.shape[1], r == record) for r, c in enumerate(group.columns)]
        elif isinstance(effect := effects.get(group.name), PathEffect):
            shared = effect.responses(history, None, linear.reduced.context)[1]
            found.append(np.logical_and(group.columns[record].any(axis=0), ~shared.any(axis=0)))
        else:
            found.append(np.full(group.width, False))
    return np.concatenate(found)


def _ridge(linear, columns, targets, rows, record, scale, used) -> tuple[np.ndarray, np.ndarray]:
    """Posterior means (used, targets) of the ``used`` weights given some rows of ``targets`` (blocks, targets), offsets by
    record integrated, and a root of their covariance (used, used)."""
    size, rows = int(used.sum()), rows[np.concatenate(linear.reduced.settled)[rows]]
    start, blocks, covariances = np.searchsorted(record, np.arange(record.max() + 1)), [], []
    for r in np.unique(record[rows]):
        at = rows[record[rows] == r]
        blocks.append(np.column_stack([columns[np.ix_(at, np.flatnonzero(used))], targets[at]]))
        covariances.append(linear.covariances[r][np.ix_(at - start[r], at - start[r])])
    white = whiten(blocks, [np.zeros(len(b)) for b in blocks], covariances, 1.0).x
    gram, moment = white[:, :size].T @ white[:, :size], white[:, :size].T @ white[:, size:]
    s = scale[used]
    lower = np.linalg.cholesky(gram * np.outer(s, s) + np.eye(size))
    root = s[:, None] * solve_triangular(lower, np.eye(size), lower=True, check_finite=False).T
    return root @ (root.T @ moment), root


def _control(fitted, own, record) -> np.ndarray:
    """What the mean residual of the other folds at the same leg and torque predicts: a smoother that names no cause."""
    linear, residual = fitted.linear, np.concatenate(fitted.residual)
    torque = np.concatenate([b.torque_nm for b in linear.reduced.blocks]) / linear.reduced.torque_scale_nm
    direction = np.concatenate([b.direction[b.leg] for b in linear.reduced.blocks])
    settled = np.concatenate(linear.reduced.settled)
    rest = np.setdiff1d(np.flatnonzero(settled), own)
    for r in np.unique(record):
        residual[record == r] -= residual[(record == r) & settled].mean()
    near = np.exp(-0.5 * ((torque[own, None] - torque[rest]) / 0.05) ** 2) * (direction[own, None] == direction[rest])
    return near @ residual[rest] / (near.sum(axis=1) + 1.0)


def closed_fraction(before, after, floor) -> np.ndarray:
    """(rms before − rms after) / (rms before − noise floor), of mean squares [rad²], within −1 and 1."""
    gap = np.sqrt(before) - np.sqrt(floor)
    return np.clip((np.sqrt(before) - np.sqrt(after)) / np.maximum(gap, SMALLEST_GAP * np.sqrt(floor)), -1.0, 1.0)
