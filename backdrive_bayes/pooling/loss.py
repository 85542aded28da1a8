"""Information lost where stored draws are compressed to mixtures and re-weighted, in bits.

A loss is the Kullback-Leibler divergence of what is reported from what the stored draws themselves say when re-weighted. It is
taken from finite draws, so that it grows with their noise as well as with a mixture that does not fit: on B bins n effective
draws add (B − 1) / (2 n ln 2) bits on the average. Draws that lie where nothing needs them show in it by that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.pooling.hierarchy import Hierarchy
from backdrive_bayes.pooling.mixture import LOG_ROOT, Mixture, log_sum

MOST_BITS = 0.2
"""Loss up to which results stand: that of a normal distribution shifted by half of its standard deviation."""
BINS = 20
"""So that either tail beyond a 90 % interval is a bin of its own."""


def batch_loss(hierarchy: Hierarchy, units: list[Mixture], draws: list, weights: list) -> float:
    """Loss of a batch's mean and spread: of the hierarchy on mixtures against that on the draws (draws,) with their weights.

    Draws resolve no density below the bandwidth of a kernel estimate (Scott's): both are compared as smoothed by that.
    """
    apart = np.zeros(hierarchy.mean.size)
    for unit, x, weight in zip(units, draws, weights, strict=True):
        share = weight / weight.sum()
        bandwidth = unit.moments[1] * np.sum(share**2) ** 0.2
        smooth = replace(hierarchy, spread=np.hypot(hierarchy.spread, bandwidth))
        apart += log_sum(np.log(share) + _log_normal(x, smooth), axis=1) - smooth.log_evidence(unit)
    log_share = apart - log_sum(apart)
    return float(np.exp(log_share) @ (log_share + np.log(apart.size)) / np.log(2))


def fit_loss(unit: Mixture, x, weight) -> float:
    """Loss of a unit's likelihood as a mixture against its draws ``x`` (draws,) with their weights."""
    return _against_uniform(unit.cdf(x), weight / weight.sum())


def unit_loss(hierarchy: Hierarchy, unit: Mixture, x, weight) -> tuple[float, float]:
    """Loss of a unit's pooled distribution, and the effective number of its draws (draws,) that lie where the batch puts it."""
    # The batch without this unit: its draws weigh the less, the better this unit already agreed with them.
    others = -hierarchy.log_evidence(unit)
    log_weight = np.log(weight) + log_sum(_log_normal(x, hierarchy) + others[:, None], axis=0)
    share = np.exp(log_weight - log_sum(log_weight))
    return _against_uniform(hierarchy.pooled(unit).cdf(x), share), float(1.0 / np.sum(share**2))


def _against_uniform(at, share) -> float:
    """Divergence from a uniform distribution of points ``at`` in [0, 1] with shares (points,), in bits."""
    held = np.bincount(np.minimum((at * BINS).astype(int), BINS - 1), share, BINS)
    return float(np.sum(held[held > 0] * np.log2(held[held > 0] * BINS)))


def _log_normal(x, hierarchy):
    """Log density of draws (draws,) under each draw of the hierarchy, (hierarchy, draws)."""
    spread = hierarchy.spread[:, None]
    return -0.5 * ((np.asarray(x) - hierarchy.mean[:, None]) / spread) ** 2 - np.log(spread) - LOG_ROOT
