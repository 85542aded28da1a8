"""Student-t mixtures as proposals: their density, their draws, and fitting them."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import kstest, multivariate_t
from scipy.stats import t as student

from backdrive_bayes.inference.proposal import (
    BROAD_SHARE,
    BROAD_STRETCH,
    DEGREES,
    StudentMixture,
    effective_share,
    fit_mixture,
    importance,
    temper,
)

SHAPE = np.array([[1.0, 0.6, 0.0], [0.6, 2.0, -0.3], [0.0, -0.3, 0.5]])
CENTRE = np.array([1.0, -2.0, 0.3])


def one_component():
    return StudentMixture(np.ones(1), CENTRE[None], np.linalg.cholesky(SHAPE)[None])


def two_bumps(rng, n=4000):
    left = rng.random(n) < 0.3
    return np.where(left[:, None], -4.0, 3.0) + rng.standard_normal((n, 2)) * np.where(
        left[:, None], 0.5, 1.5
    )


def test_one_component_is_the_multivariate_t():
    z = np.random.default_rng(0).normal(0, 3, (50, 3))
    expected = multivariate_t(CENTRE, SHAPE, df=DEGREES).logpdf(z)
    np.testing.assert_allclose(one_component().log_density(z), expected, rtol=1e-10)


def test_a_single_has_a_broad_copy():
    z = np.random.default_rng(0).normal(0, 3, (50, 3))
    narrow = multivariate_t(CENTRE, SHAPE, df=DEGREES).pdf(z)
    broad = multivariate_t(CENTRE, BROAD_STRETCH**2 * SHAPE, df=DEGREES).pdf(z)
    expected = np.log((1 - BROAD_SHARE) * narrow + BROAD_SHARE * broad)
    np.testing.assert_allclose(StudentMixture.single(CENTRE, SHAPE).log_density(z), expected, rtol=1e-6)


def test_mixture_density_integrates_to_one():
    rng = np.random.default_rng(1)
    line = fit_mixture(two_bumps(rng)[:, :1], np.full(4000, 1 / 4000), rng, 3)
    total = quad(
        lambda x: np.exp(line.log_density(np.array([[x]]))[0]), -80, 80, points=[-4, 0, 3], limit=200
    )[0]
    assert total == pytest.approx(1, abs=1e-4)
    plane = fit_mixture(two_bumps(rng), np.full(4000, 1 / 4000), rng, 3)
    # By importance sampling from a wider density: the mean weight is the integral.
    cover = StudentMixture.single(np.zeros(2), 25 * np.eye(2))
    z = cover.draw(rng, 40_000)
    weight = np.exp(plane.log_density(z) - cover.log_density(z))
    assert weight.mean() == pytest.approx(1, abs=5 * weight.std() / 200)


def test_draws_follow_the_density():
    draws = one_component().draw(np.random.default_rng(2), 5000)
    law = student(DEGREES, CENTRE[1], np.sqrt(SHAPE[1, 1]))
    assert kstest(draws[:, 1], law.cdf).pvalue > 1e-4
    gaussian = CENTRE + np.random.default_rng(2).multivariate_normal(np.zeros(3), SHAPE, 20_000)
    assert kstest(gaussian[:, 1], law.cdf).pvalue < 1e-4, "normal tails must not pass for Student-t ones"
    two = StudentMixture(np.array([0.25, 0.75]), np.array([[-9.0], [9.0]]), np.ones((2, 1, 1)))
    assert (two.draw(np.random.default_rng(3), 8000) < 0).mean() == pytest.approx(0.25, abs=0.02)


def test_fit_finds_two_bumps():
    rng = np.random.default_rng(4)
    draws, even = two_bumps(rng), np.full(4000, 1 / 4000)
    two, one = fit_mixture(draws, even, rng, 2), fit_mixture(draws, even, rng, 1)
    order = np.argsort(two.mean[:2, 0])
    np.testing.assert_allclose(two.share[:2][order] / two.share[:2].sum(), [0.3, 0.7], atol=0.03)
    np.testing.assert_allclose(two.mean[:2][order], [[-4, -4], [3, 3]], atol=0.15)
    assert two.log_density(draws).mean() > one.log_density(draws).mean() + 0.3


def test_one_part_has_the_weighted_moments():
    rng = np.random.default_rng(5)
    draws, weight = rng.normal(0, [1.0, 1e-4], (3000, 2)), rng.random(3000)
    weight /= weight.sum()
    fitted = fit_mixture(draws, weight, rng, 1)
    mean = weight @ draws
    np.testing.assert_allclose(fitted.mean[0], mean, atol=1e-10)
    covariance = (draws - mean).T @ ((draws - mean) * weight[:, None])
    np.testing.assert_allclose(fitted.factor[0] @ fitted.factor[0].T, covariance, rtol=1e-3, atol=1e-12)


def test_importance_weights_correct_a_wrong_proposal():
    rng = np.random.default_rng(6)
    proposal = StudentMixture.single(np.array([0.5]), np.array([[2.0]]))
    z, value, weight = importance(lambda x: -0.5 * x[:, 0] ** 2, proposal, rng, 40_000)
    assert weight.sum() == pytest.approx(1) and np.array_equal(value, -0.5 * z[:, 0] ** 2)
    assert weight @ z[:, 0] == pytest.approx(0, abs=0.03)
    assert weight @ z[:, 0] ** 2 == pytest.approx(1, abs=0.04)
    assert z[:, 0].mean() == pytest.approx(0.5, abs=0.05), "unweighted, the proposal must show"


@pytest.mark.parametrize("share", [0.05, 0.4, 0.8])
def test_tempering_reaches_the_asked_share(share):
    log_weight = np.random.default_rng(7).normal(0, 6, 1000)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    assert effective_share(weight) < share
    flat = temper(weight, share)
    assert effective_share(flat) >= share and flat.sum() == pytest.approx(1)
    assert (np.argsort(flat) == np.argsort(weight)).all()
