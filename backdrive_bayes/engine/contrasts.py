"""Evidence for what breaks a symmetry: effects weighed in what the class cannot hold.

The class is integrated under a prior ``WIDENED`` times wider than what the unit taught, so that an effect gains
nothing by drawing
again what the class has learnt already (columns made from the prediction look like the loop itself). What is left are
contrasts: between mirrored branches, rates, times and legs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.linear import Linear

WIDENED = 5.0
SIZES = np.exp([-1.5, 0.0, 1.5])
"""Sizes of an effect over its usual one, averaged over with these weights: """
SIZE_WEIGHTS = np.array([0.25, 0.5, 0.25])


@dataclass(frozen=True, eq=False)
class Contrasts:
    """Effects' columns and the data with the class integrated: Gram matrices of what is left.

    ``gram`` (weights, weights), ``moment`` (weights,), ``total``; ``index`` numbers the group of a weight;
    ``samples`` is the number of
    independent contrasts.
    """

    names: tuple[str, ...]
    index: np.ndarray
    gram: np.ndarray
    moment: np.ndarray
    total: float
    samples: float
    noise_dof: float

    def log_marginal(self, scale) -> float:
        """Log marginal likelihood for standard deviations of the weights, up to a constant."""
        on = scale > 0
        inner = self.gram[np.ix_(on, on)] * np.outer(scale[on], scale[on])
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        seen = solve_triangular(lower, scale[on] * self.moment[on], lower=True, check_finite=False)
        chi2 = max(self.total - float(seen @ seen), 0.0)
        dof = self.noise_dof + self.samples
        return -0.5 * dof * np.log1p(chi2 / self.noise_dof) - float(np.log(np.diag(lower)).sum())

    def chi2(self, scale) -> float:
        """What is left of the contrasts at the posterior mean, over their number."""
        on = scale > 0
        inner = self.gram[np.ix_(on, on)] * np.outer(scale[on], scale[on])
        inner[np.diag_indices_from(inner)] += 1.0
        lower = cholesky(inner, lower=True, check_finite=False)
        seen = solve_triangular(lower, scale[on] * self.moment[on], lower=True, check_finite=False)
        return max(self.total - float(seen @ seen), 0.0) / self.samples


def make_contrasts(linear: Linear, groups: tuple[Group, ...]) -> Contrasts:
    """Contrasts of a unit for the linear model's effects and further ``groups``."""
    core = [i for i, n in enumerate(linear.design.names) if n in _class_names(linear)]
    effects = tuple(g for i, g in enumerate(linear.design.groups) if i not in core) + groups
    design = Design(effects)
    data = linear.whitened(design)
    own = np.isin(linear.design.index, core)
    scale = WIDENED * np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index[own]]
    inner = linear.data.gram[np.ix_(own, own)] * np.outer(scale, scale)
    inner[np.diag_indices_from(inner)] += 1.0
    lower = cholesky(inner, lower=True, check_finite=False)
    seen = solve_triangular(lower, (linear.data.x[:, own] * scale).T, lower=True, check_finite=False)
    columns, angle = seen @ data.x, seen @ data.y
    return Contrasts(
        design.names,
        design.index,
        data.gram - columns.T @ columns,
        data.moment - columns.T @ angle,
        data.total - float(angle @ angle),
        data.samples - float(np.sum(seen**2)),
        data.noise_dof,
    )


def _class_names(linear):
    return {p.name for p in linear.reducer.parts} | {"initial", "floating"}


def averaged(log_marginals) -> float:
    """Log marginal likelihood averaged over SIZES; ``log_marginals`` (sizes,)."""
    return float(logsumexp(log_marginals, b=SIZE_WEIGHTS))
