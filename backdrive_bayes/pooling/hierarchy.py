"""The hierarchy of a batch: units' true values are normal about a batch mean with a batch spread, both unknown.

A flat density of the mean and of the spread serves from five units on: Gelman, Prior distributions for variance parameters in
hierarchical models, Bayesian Analysis 1 (2006), 515–534, doi:10.1214/06-BA117A.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.engine.diagnostics import Convergence
from backdrive_bayes.engine.sample import sample_density
from backdrive_bayes.pooling.mixture import LOG_ROOT, Mixture, log_sum

FEWEST_UNITS = 5
"""Below it a flat density of the spread leaves nearly any spread possible."""


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Draws (draws,) of a batch's ``mean`` and ``spread``, and their convergence."""

    mean: np.ndarray
    spread: np.ndarray
    convergence: Convergence

    def thinned(self, most: int) -> Hierarchy:
        """At most ``most`` draws, evenly taken."""
        keep = np.linspace(0, self.mean.size - 1, min(most, self.mean.size)).astype(int)
        return Hierarchy(self.mean[keep], self.spread[keep], self.convergence)

    @property
    def next_unit(self) -> Mixture:
        """Predictive distribution of a further unit's true value."""
        return Mixture(np.full(self.mean.size, 1.0 / self.mean.size), self.mean, self.spread)

    def log_evidence(self, unit: Mixture) -> np.ndarray:
        """Log of ∫ L(x) N(x; mean, spread²) dx for each draw, (draws,); ``unit`` is a unit's likelihood L as a mixture."""
        return _log_evidence(self.mean, self.spread, unit.weight, unit.mean, unit.sd)

    def pooled(self, unit: Mixture) -> Mixture:
        """A unit's true value given its own likelihood and all units of the batch."""
        total = unit.sd**2 + self.spread[:, None] ** 2
        log_share = np.log(unit.weight) - 0.5 * np.log(total) - 0.5 * (self.mean[:, None] - unit.mean) ** 2 / total
        share = np.exp(log_share - log_sum(log_share)[:, None]) / self.mean.size
        shrinking = unit.sd**2 / total
        mean = unit.mean + shrinking * (self.mean[:, None] - unit.mean)
        return Mixture(share.ravel(), mean.ravel(), (self.spread[:, None] * np.sqrt(shrinking)).ravel())


def sample_hierarchy(units: list[Mixture], seed: int) -> Hierarchy:
    """Draws of a batch's mean and spread from its units' likelihoods."""
    target = _Target(units)
    drawn, convergence = sample_density(target, *_beginning(units), ("mean", "log_spread"), seed)
    mean, log_spread = drawn.reshape(-1, 2).T
    return Hierarchy(mean * target.scale + target.centre, np.exp(log_spread) * target.scale, convergence)


class _Target:
    """Log posterior density of mean and log spread, in standard deviations of the units' means about their centre."""

    def __init__(self, units):
        moments = np.array([u.moments for u in units])
        self.centre = float(moments[:, 0].mean())
        self.scale = float(np.sqrt(moments[:, 0].var() + np.mean(moments[:, 1] ** 2)))
        most = max(u.weight.size for u in units)
        weight, mean, sd = np.zeros((len(units), most)), np.zeros((len(units), most)), np.ones((len(units), most))
        for i, unit in enumerate(units):
            k = unit.weight.size
            weight[i, :k], mean[i, :k], sd[i, :k] = unit.weight, (unit.mean - self.centre) / self.scale, unit.sd / self.scale
        self.units, self.evaluations = (weight, mean, sd), 0

    def __call__(self, points):
        points = np.atleast_2d(points)
        self.evaluations += len(points)
        mean, log_spread = points[:, 0, None], np.clip(points[:, 1, None], -300.0, 300.0)
        # Flat in the spread, hence rising with it per unit of its logarithm.
        return _log_evidence(mean, np.exp(log_spread), *self.units).sum(axis=1) + points[:, 1]


def _log_evidence(mean, spread, weight, unit_mean, unit_sd):
    """Draws by units' components to draws (by units)."""
    total = unit_sd**2 + np.asarray(spread)[..., None] ** 2
    with np.errstate(divide="ignore"):
        parts = np.log(weight) - 0.5 * np.log(total) - LOG_ROOT - 0.5 * (np.asarray(mean)[..., None] - unit_mean) ** 2 / total
    return log_sum(parts)


def _beginning(units) -> tuple[np.ndarray, np.ndarray]:
    """Where the first proposals are made, by moments, and the root of their covariance."""
    moments = np.array([u.moments for u in units])
    own2 = float(np.mean(moments[:, 1] ** 2))
    total = float(moments[:, 0].var() + own2)
    spread2 = max(float(moments[:, 0].var(ddof=1)) - own2, 0.1 * own2, 1e-12 * total)
    told = (1 + own2 / spread2) / np.sqrt(2 * (len(units) - 1))
    root = np.diag([np.sqrt((own2 + spread2) / len(units) / total), min(told, 1.0)])
    return np.array([0.0, 0.5 * np.log(spread2 / total)]), root
