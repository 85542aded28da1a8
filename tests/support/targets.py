"""A target with known moments and no Gaussian shape, and checks of draws against it."""

import numpy as np
from scipy.special import log_ndtr

from backdrive_bayes.inference.proposal import StudentMixture

CURVE, NARROW, SKEW = 0.5, 0.5, 6.0


class Banana:
    """x standard normal, y a bent ridge over x, w all but cut off below zero (skew-normal), v normal."""

    dimension = 4
    mean = np.array([0.0, 0.0, SKEW / np.sqrt(1 + SKEW**2) * np.sqrt(2 / np.pi), 1.0])
    sd = np.sqrt([1.0, NARROW**2 + 2 * CURVE**2, 1 - SKEW**2 / (1 + SKEW**2) * 2 / np.pi, 4.0])

    @staticmethod
    def log_posterior(z):
        z = np.atleast_2d(z)
        x, y, w, v = z.T
        bent = y - CURVE * (x**2 - 1)
        return (
            -0.5 * x**2
            - 0.5 * (bent / NARROW) ** 2
            - 0.5 * w**2
            + log_ndtr(SKEW * w)
            - 0.5 * ((v - 1) / 2) ** 2
        )


def along_the_ridge():
    """A proposal whose parts follow the bend, wide enough for honest importance weights."""
    x = np.array([-3.0, -1.8, -0.6, 0.6, 1.8, 3.0])
    share = np.exp(-0.4 * x**2)
    mean = np.column_stack([x, CURVE * (x**2 - 1), np.full(x.size, 0.7), np.ones(x.size)])
    slope = 2 * CURVE * x
    covariance = np.zeros((x.size, 4, 4))
    covariance[:, 0, 0], covariance[:, 2, 2], covariance[:, 3, 3] = 0.6, 0.6, 4.5
    covariance[:, 0, 1] = covariance[:, 1, 0] = 0.6 * slope
    covariance[:, 1, 1] = 0.6 * slope**2 + 0.35
    return StudentMixture.of(share / share.sum(), mean, covariance)


def moments_by_importance(log_posterior, proposal, rng, draws=200_000):
    """Means and standard deviations (dimension,) by importance sampling, nothing of emcee in them."""
    z = proposal.draw(rng, draws)
    log_weight = log_posterior(z) - proposal.log_density(z)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    mean = weight @ z
    return mean, np.sqrt(weight @ (z - mean) ** 2)


def disagreement(draws, mean, sd):
    """Pulls and errors of means and sds over independent ensembles (ensembles, draws, dimension)."""
    count = draws.shape[0]
    pulls, errors = [], []
    for found, true in ((draws.mean(axis=1), mean), (draws.std(axis=1), sd)):
        pulls.append((found.mean(axis=0) - true) / (found.std(axis=0, ddof=1) / np.sqrt(count)))
        errors.append((found.mean(axis=0) - true) / sd)
    return np.abs(pulls), np.abs(errors)


def agrees(draws, mean, sd, pull=5.0, slack=0.03):
    """Whether every moment is within its Monte-Carlo error (or a ``slack`` of a standard deviation)."""
    pulls, errors = disagreement(draws, mean, sd)
    return bool(((pulls < pull) | (errors < 0.25 * slack)).all() and (errors < slack + 1e-12).all())
