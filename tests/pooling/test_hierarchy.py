"""A batch's mean and spread against quadrature, and units' pooled distributions against their own."""

from functools import cache

import numpy as np
import pytest
from scipy.stats import norm

from backdrive_bayes.pooling.hierarchy import Hierarchy, sample_hierarchy
from backdrive_bayes.pooling.mixture import Mixture
from backdrive_bayes.pooling.quantity import shortest

ESTIMATES, SDS = np.array([28, 8, -3, 7, -1, 1, 18, 12.0]), np.array([15, 10, 16, 11, 9, 11, 10, 18.0])
"""The eight schools (Rubin 1981; Gelman et al., Bayesian Data Analysis, 5.5)."""


def normal(mean, sd):
    return Mixture(np.ones(1), np.array([float(mean)]), np.array([float(sd)]))


@pytest.fixture(scope="module")
def schools():
    return sample_hierarchy([normal(m, s) for m, s in zip(ESTIMATES, SDS, strict=True)], 3)


@cache
def quadrature():
    """Quantiles of the spread and of the mean under flat densities of both, from a fine grid."""
    spread = np.linspace(1e-4, 120, 6_000)
    total = SDS[:, None] ** 2 + spread**2
    known = 1 / np.sum(1 / total, axis=0)
    mean = known * np.sum(ESTIMATES[:, None] / total, axis=0)
    log = 0.5 * np.log(known) - 0.5 * np.log(total).sum(axis=0) - 0.5 * ((ESTIMATES[:, None] - mean) ** 2 / total).sum(axis=0)
    share = np.exp(log - log.max())
    share /= share.sum()
    x = np.linspace(-30, 50, 801)
    below = np.array([share @ norm.cdf(v, mean, np.sqrt(known)) for v in x])
    levels = [0.05, 0.25, 0.5, 0.75, 0.95]
    return np.interp(levels, np.cumsum(share), spread), np.interp(levels, below, x)


def test_the_eight_schools_by_quadrature(schools):
    spread, mean = quadrature()
    assert schools.convergence.converged
    assert np.quantile(schools.spread, [0.05, 0.25, 0.5, 0.75, 0.95]) == pytest.approx(spread, rel=0.12, abs=0.25)
    # Three standard errors of a tail quantile: the mean is known to ±5 and its effective draws are 600.
    assert np.quantile(schools.mean, [0.05, 0.25, 0.5, 0.75, 0.95]) == pytest.approx(mean, abs=1.3)


def test_a_density_flat_in_the_logarithm_of_the_spread_would_not_agree(schools):
    """The planted fault: the Jacobian left out."""
    weight = 1 / schools.spread
    order = np.argsort(schools.spread)
    median = np.interp(0.5, np.cumsum(weight[order]) / weight.sum(), schools.spread[order])
    assert median < 0.7 * quadrature()[0][2]


def test_pooled_units_are_shrunk_as_the_book_has_them(schools):
    """Bayesian Data Analysis, table 5.3: medians 10 (A), 8 (B), 7 (C), 8 (D), 5 (E), 6 (F), 10 (G), 8 (H)."""
    found = [schools.pooled(normal(m, s)).quantile([0.5])[0] for m, s in zip(ESTIMATES, SDS, strict=True)]
    assert found == pytest.approx([10, 8, 7, 8, 5, 6, 10, 8], abs=1.0)


def test_pooled_is_the_product_for_a_known_batch():
    known = Hierarchy(np.array([1.0]), np.array([0.5]), None)
    unit = Mixture(np.array([0.4, 0.6]), np.array([0.0, 3.0]), np.array([0.3, 0.8]))
    x = np.linspace(-4, 6, 20_001)
    product = np.exp(unit.log_density(x)) * norm.pdf(x, 1.0, 0.5)
    evidence = np.trapezoid(product, x)
    assert np.exp(known.pooled(unit).log_density(x)) == pytest.approx(product / evidence, abs=1e-6)
    assert known.log_evidence(unit) == pytest.approx(np.log(evidence), abs=1e-8)


def test_scale_and_origin_do_not_matter(schools):
    moved = sample_hierarchy([normal(1e-4 * m + 7, 1e-4 * s) for m, s in zip(ESTIMATES, SDS, strict=True)], 3)
    assert moved.spread == pytest.approx(1e-4 * schools.spread, rel=1e-6)
    assert moved.mean == pytest.approx(7 + 1e-4 * schools.mean, rel=1e-9)


def test_the_shortest_interval_reaches_zero_where_the_units_do_not_differ():
    rng = np.random.default_rng(0)
    assert shortest(np.abs(rng.standard_normal(2000)), 0.9)["lo"] == 0.0
    away = shortest(rng.normal(5, 0.5, 20_000), 0.9)
    assert (away["lo"], away["hi"]) == (pytest.approx(5 - 0.822, abs=0.06), pytest.approx(5 + 0.822, abs=0.06))
