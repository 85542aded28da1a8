"""Flanks with friction in proportion to their load: the ratios of their switching torques are selected by marginal likelihood."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.hermite import hermgauss
from scipy.special import logsumexp

from backdrive_bayes.engine.design import Design, Group, grown_histories
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import Known, Moments
from backdrive_bayes.mechanics.friction import FLANK_SCALE, flank

RATIOS = np.arange(-0.9, 0.98, 0.06)
"""Ratios of the first grid: from flanks that release only beyond zero torque to flanks with next to no friction. A flank between
two of them raises the marginal likelihood of both."""
REFINEMENTS = 3
"""How often the grid is halved about the best ratio, to a distance below one hundredth."""
NODES, WEIGHTS = hermgauss(5)
SCALES, WEIGHTS = np.exp(FLANK_SCALE[0] + FLANK_SCALE[1] * np.sqrt(2.0) * NODES), WEIGHTS / WEIGHTS.sum()
"""Scales of a flank and their shares of its prior: a scale of its own is not known before it is there."""
PRICE = float(np.log(RATIOS.size))
"""Log prior odds against one ratio among those of the grid."""


def select_flank(linear: Linear) -> np.ndarray:
    """Ratios of the flanks of a class, (flanks,): those that it has, and one more where its log marginal likelihood is higher by
    more than PRICE, other scales and the distortion as they are."""
    known, near, step = linear.reducer.ratios, RATIOS, float(np.diff(RATIOS)[0])
    tried: dict[float, float] = {}
    for _ in range(REFINEMENTS + 1):
        new = [float(r) for r in near if r not in tried and np.abs(np.r_[known, -2.0] - r).min() > 0.5 * step]
        tried |= dict(zip(new, _gains(linear, new) if new else (), strict=True))
        best, step = max(tried, key=tried.__getitem__), 0.5 * step
        near = np.array([best - step, best + step])
    return np.sort(np.r_[known, best]) if tried[best] > PRICE else known


def _gains(linear: Linear, ratios: list[float]) -> list[float]:
    """Gains in the log marginal likelihood by one flank of each ratio."""
    data, scale = linear.data, np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    grown = grown_histories(linear.reduced, linear.distortion)
    groups = tuple(
        Group("flanks", tuple(cells.grown(growth[0], growth[2]).means(history) @ mixing for history, growth in grown))
        for cells, mixing in map(flank, ratios)
    )
    rows = np.column_stack([data.x, linear.whitened(Design(groups)).x, data.y])
    joined = Moments(rows.T @ rows, data.samples, data.noise_dof)
    left = Known.of(joined, np.arange(rows.shape[1] - 1) < scale.size, scale).left

    def log_marginal(columns, scale: float = 1.0) -> float:
        own = np.r_[columns, left.inner.shape[0] - 1].astype(int)
        moments = Moments(left.inner[np.ix_(own, own)], data.samples, data.noise_dof)
        return float(moments.log_marginal(np.full(own.size - 1, scale)))

    columns = np.split(np.arange(left.inner.shape[0] - 1), np.cumsum([g.width for g in groups])[:-1])
    without = log_marginal([])
    return [float(logsumexp([log_marginal(own, s) for s in SCALES], b=WEIGHTS)) - without for own in columns]
