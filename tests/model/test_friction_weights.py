"""Friction's weights on its grid of thresholds, and what they make of the mean threshold."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import lognorm

from backdrive_bayes.model.friction import CONSTANT_SHARES, LOAD_RATIOS
from backdrive_bayes.model.hat_weights import hat_weights


def nearest_node_weights(nodes, mean, spread):
    """A planted fault: each node gets the mass of its neighbourhood, and the mean is lost."""
    law = lognorm(spread[..., 0], scale=mean[..., 0] * np.exp(-0.5 * spread[..., 0] ** 2))
    edges = np.r_[0, 0.5 * (nodes[1:] + nodes[:-1]), np.inf]
    return np.diff(law.cdf(edges))[None]


def mean_error(weights, nodes, mean):
    return np.abs(weights @ nodes / mean[:, 0] - 1).max()


@pytest.mark.parametrize("nodes", [CONSTANT_SHARES, LOAD_RATIOS])
def test_weights_are_a_distribution(nodes):
    rng = np.random.default_rng(0)
    mean, spread = np.exp(rng.normal(-3, 1.5, (500, 1))), np.exp(rng.normal(-0.7, 0.6, (500, 1)))
    weights = hat_weights(nodes, mean, spread)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-14)
    assert weights.min() > -1e-15


@pytest.mark.parametrize("nodes", [CONSTANT_SHARES, LOAD_RATIOS])
@pytest.mark.parametrize("spread", [0.02, 0.3, 0.6])
def test_mean_is_preserved_inside_the_grid(nodes, spread):
    mean = np.geomspace(1e-5, nodes[-1] * np.exp(-7.5 * spread), 20)[:, None]
    assert mean_error(hat_weights(nodes, mean, np.full((20, 1), spread)), nodes, mean) < 1e-9


def test_a_scheme_that_loses_the_mean_is_noticed():
    mean, spread = np.array([[0.03]]), np.array([[0.3]])
    assert mean_error(nearest_node_weights(CONSTANT_SHARES, mean, spread), CONSTANT_SHARES, mean) > 1e-3


def test_each_weight_is_the_integral_of_its_hat():
    mean, spread, nodes = 0.05, 0.5, CONSTANT_SHARES
    law = lognorm(spread, scale=mean * np.exp(-0.5 * spread**2))
    weights = hat_weights(nodes, np.array([mean]), np.array([spread]))
    for k in range(1, nodes.size - 1):
        hat = np.eye(nodes.size)[k]
        expected = quad(
            lambda x, h=hat: np.interp(x, nodes, h) * law.pdf(x),
            nodes[k - 1],
            nodes[k + 1],
            points=[nodes[k]],
        )[0]
        assert weights[k] == pytest.approx(expected, abs=1e-10)


def test_what_lies_beyond_the_grid_goes_to_its_last_node():
    weights = hat_weights(CONSTANT_SHARES, np.array([50.0]), np.array([0.1]))
    np.testing.assert_allclose(weights, np.eye(CONSTANT_SHARES.size)[-1], atol=1e-12)
