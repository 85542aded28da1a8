"""Priors as monotone transforms of a standard normal variable."""

import numpy as np
import pytest
from scipy.stats import binom, kstest, lognorm, loguniform, norm, uniform
from support.known import SCALE, reducer

from backdrive_bayes.model.parameter import BoundedLogNormal, LogNormal, LogUniform, Normal, Parameter, Uniform
from backdrive_bayes.model.registry import MEMBERS

PRIORS = {p.name: p.scaled_prior(SCALE) for p in reducer(MEMBERS).parameters}


class LogitNormal:
    """log(x / (hi - x)) is normal: median at the stated median, log-sd as stated far below the bound."""

    def __init__(self, prior):
        self.hi = prior.hi
        self.normal = norm(np.log(prior.median / (prior.hi - prior.median)), prior.sigma)

    def cdf(self, x):
        return self.normal.cdf(np.log(x / (self.hi - x)))

    def ppf(self, share):
        odds = np.exp(self.normal.ppf(share))
        return self.hi * odds / (1 + odds)

    def median(self):
        return self.ppf(0.5)


def stated(prior):
    """The distribution the prior says it is, from SciPy."""
    if isinstance(prior, LogNormal):
        return lognorm(prior.sigma, scale=prior.median)
    if isinstance(prior, BoundedLogNormal):
        return LogitNormal(prior)
    if isinstance(prior, LogUniform):
        return loguniform(prior.lo, prior.hi)
    if isinstance(prior, Normal):
        return norm(0, prior.sd)
    return uniform(prior.lo, prior.hi - prior.lo)


def median_is(values, median, level=0.999):
    low, high = binom.interval(level, values.size, 0.5)
    return low <= (values < median).sum() <= high


@pytest.mark.parametrize("name", PRIORS)
def test_round_trip(name):
    z = np.linspace(-5, 5, 41)
    np.testing.assert_allclose(PRIORS[name].to_normal(PRIORS[name].from_normal(z)), z, atol=1e-6)
    value = stated(PRIORS[name]).ppf(np.linspace(0.01, 0.99, 25))
    np.testing.assert_allclose(
        PRIORS[name].from_normal(PRIORS[name].to_normal(value)), value, rtol=1e-10, atol=1e-12
    )


@pytest.mark.parametrize("name", PRIORS)
def test_normal_draws_follow_the_stated_distribution(name):
    draws = PRIORS[name].from_normal(np.random.default_rng(11).normal(size=2000))
    assert kstest(draws, stated(PRIORS[name]).cdf).pvalue > 1e-4
    assert median_is(draws, stated(PRIORS[name]).median())
    shifted = PRIORS[name].from_normal(np.random.default_rng(11).normal(size=2000) + 0.15)
    assert not median_is(shifted, stated(PRIORS[name]).median()), "a prior off by 0.15 sd must be noticed"


def test_uniform_bounds_do_not_leave_the_normal_space():
    assert np.isfinite(Uniform(-1, 1).to_normal([-1.0, 1.0])).all()


@pytest.mark.parametrize(
    ("dimension", "factor"),
    [("torque", 0.1), ("angle", 0.02), ("compliance", 0.2), ("none", 1.0)],
)
def test_scaled_prior_carries_the_units(dimension, factor):
    log = Parameter("x", "u", dimension, LogNormal(0.5, 0.7), None, "s").scaled_prior(SCALE)
    even = Parameter("x", "u", dimension, Uniform(-1, 3), None, "s").scaled_prior(SCALE)
    assert (log.median, log.sigma) == (pytest.approx(0.5 * factor), 0.7)
    assert (even.lo, even.hi) == (pytest.approx(-factor), pytest.approx(3 * factor))
