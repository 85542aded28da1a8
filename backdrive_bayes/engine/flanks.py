"""Flanks with friction in proportion to their load: at which shares of a torque they slip back is searched."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular

from backdrive_bayes.engine.design import Design, Group, grown_histories
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.mechanics.reducer import flank

RATIOS = np.arange(-0.9, 0.98, 0.06)
"""Ratios that are tried first; about the best of them closer ones, at halves of the distance, HALVINGS times."""
HALVINGS = 3
PRICE = float(np.log(RATIOS.size))
"""What it costs to choose one of them."""


def with_flank(linear: Linear) -> np.ndarray:
    """Ratios of a class at which flanks slip back, with one more if that has the higher marginal likelihood, other things as they
    are."""
    known, near, step = linear.reducer.ratios, RATIOS, float(np.diff(RATIOS)[0])
    tried: dict[float, float] = {}
    for _ in range(HALVINGS + 1):
        new = [float(r) for r in near if r not in tried and np.abs(np.r_[known, -2.0] - r).min() > 0.5 * step]
        tried |= dict(zip(new, _gains(linear, new), strict=True))
        best, step = max(tried, key=tried.__getitem__), 0.5 * step
        near = np.array([best - step, best + step])
    return np.sort(np.r_[known, best]) if tried[best] > PRICE else known


def _gains(linear: Linear, ratios) -> list[float]:
    """Gains in the log marginal likelihood by one flank of each ratio."""
    data, scale = linear.data, np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    grown = grown_histories(linear.reduced, linear.distortion)
    groups = [
        Group("friction", tuple(cells.grown(growth[0]).means(history) @ mixing for history, growth in grown))
        for cells, mixing in map(flank, ratios)
    ]
    if not groups:
        return []
    more = linear.whitened(Design(tuple(groups))).x * np.exp(linear.log_scale["friction"])
    lower, seen, chi2 = data.moments.factor(scale)
    across = solve_triangular(lower, scale[:, None] * (data.x.T @ more), lower=True, check_finite=False)
    found, ends = [], np.cumsum([0, *(g.width for g in groups)])
    for begin, end in zip(ends[:-1], ends[1:], strict=True):
        own, shared = more[:, begin:end], across[:, begin:end]
        root = np.linalg.cholesky(np.eye(end - begin) + own.T @ own - shared.T @ shared)
        less = solve_triangular(root, own.T @ data.y - shared.T @ seen, lower=True)
        fall = np.log1p(chi2 / data.noise_dof) - np.log1p(max(chi2 - float(less @ less), 0.0) / data.noise_dof)
        found.append(0.5 * data.moments.dof * float(fall) - float(np.log(np.diag(root)).sum()))
    return found
