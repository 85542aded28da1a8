"""Mixtures of normals: what is fitted, and what is asked of it."""

import numpy as np
import pytest
from scipy.stats import norm

from backdrive_bayes.pooling.mixture import Mixture, fit_mixture, log_sum

TWO = Mixture(np.array([0.3, 0.7]), np.array([-1.0, 2.0]), np.array([0.5, 0.2]))


def test_density_distribution_and_quantiles_are_scipys():
    x = np.linspace(-3, 3, 41)
    density = 0.3 * norm.pdf(x, -1, 0.5) + 0.7 * norm.pdf(x, 2, 0.2)
    assert np.exp(TWO.log_density(x)) == pytest.approx(density)
    assert TWO.cdf(x) == pytest.approx(0.3 * norm.cdf(x, -1, 0.5) + 0.7 * norm.cdf(x, 2, 0.2))
    assert TWO.cdf(TWO.quantile([0.05, 0.5, 0.95])) == pytest.approx([0.05, 0.5, 0.95])
    mean = 0.3 * -1 + 0.7 * 2
    assert TWO.moments == pytest.approx((mean, np.sqrt(0.3 * (0.25 + 1) + 0.7 * (0.04 + 4) - mean**2)))
    assert log_sum(np.array([[0.0, -np.inf], [1.0, 1.0]])) == pytest.approx([0.0, 1.0 + np.log(2)])


def test_normal_draws_are_one_component():
    x = np.random.default_rng(0).normal(3.0, 0.1, 1600)
    found = fit_mixture(x)
    assert found.weight.size == 1
    assert found.moments == pytest.approx((x.mean(), x.std()))


def test_two_humps_are_found():
    rng = np.random.default_rng(1)
    x = np.where(rng.random(4000) < 0.3, rng.normal(-1, 0.5, 4000), rng.normal(2, 0.2, 4000))
    found = fit_mixture(x)
    order = np.argsort(found.mean)
    assert found.mean[order] == pytest.approx(TWO.mean, abs=0.06)
    assert found.sd[order] == pytest.approx(TWO.sd, abs=0.05)
    assert found.weight[order] == pytest.approx(TWO.weight, abs=0.03)


def test_weights_count():
    """Draws of a wide normal re-weighted to a narrow one."""
    x = np.random.default_rng(2).normal(0.0, 1.0, 20000)
    found = fit_mixture(x, norm.pdf(x, 0.5, 0.5) / norm.pdf(x))
    assert found.moments == pytest.approx((0.5, 0.5), abs=0.02)


def test_draws_that_are_all_the_same_are_no_error():
    assert fit_mixture(np.full(50, 2.0)).moments[0] == pytest.approx(2.0)
