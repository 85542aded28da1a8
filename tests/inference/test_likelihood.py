"""The reduced likelihood: offsets, the common noise factor and the discrepancy are marginalised exactly."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal
from support.bench import (
    KNOWN_NOISE,
    kalman_whiten,
    known_estimate,
    problem_of,
    raw_covariance,
    unit_of,
    without_offset,
)
from support.known import RATED

from backdrive_bayes.inference.covariance import block_covariance
from backdrive_bayes.inference.problem import Problem


@pytest.fixture(scope="module")
def problem():
    return problem_of(
        unit_of(0, rate=0.2, amplitudes=(RATED, 0.5 * RATED)), KNOWN_NOISE, blocks_per_segment=30
    )


@pytest.fixture(scope="module")
def points(problem):
    return np.random.default_rng(1).normal(0.3, 0.05, (12, problem.dimension))


def raw_residuals(problem, z, record):
    data = problem.records[record]
    return data.blocks.angle_rad - problem.model.angle(problem.values(z, record), data.path)


def differences(values):
    return values[1:] - values[0]


def test_offset_marginalisation_is_a_huge_constant_covariance(problem, points):
    total, kept = 0.0, 0.0
    for r, data in enumerate(problem.records):
        covariance = block_covariance(data.blocks, known_estimate(KNOWN_NOISE))
        residual = raw_residuals(problem, points, r)
        n = residual.shape[1]
        total = total + multivariate_normal(
            np.zeros(n), covariance + 1e4 * KNOWN_NOISE.correlated_rad**2
        ).logpdf(residual)
        kept = kept + multivariate_normal(np.zeros(n), covariance).logpdf(residual)
    reduced = differences(problem.log_likelihood(points))
    np.testing.assert_allclose(reduced, differences(total), rtol=2e-3, atol=1e-2)
    assert np.abs(reduced - differences(kept)).max() > 1, "an offset held at zero must not pass"


def test_offset_marginalisation_is_an_integral(problem, points):
    data = problem.records[0]
    alone = Problem(problem.model, (data,))
    # Near each other, for the noise is known to a finite number of degrees of freedom.
    z = 0.3 + 0.3 * (points[:2, : alone.dimension] - 0.3)
    covariance = block_covariance(data.blocks, known_estimate(KNOWN_NOISE))
    law = multivariate_normal(np.zeros(data.blocks.count.size), covariance)
    residual, best = raw_residuals(alone, z, 0), alone.offsets_rad(z)[:, 0]
    sd = data.offset_sd_rad
    logs = []
    for row, centre in zip(residual, best, strict=True):
        peak = law.logpdf(row - centre)
        # In standard deviations of the offset: quad's absolute tolerance is for areas of about one.
        area = quad(lambda u, row=row, peak=peak, centre=centre: np.exp(law.logpdf(row - centre - u * sd) - peak), -9, 9)[0]
        logs.append(peak + np.log(area))
    assert logs[1] - logs[0] == pytest.approx(np.diff(alone.log_likelihood(z))[0], abs=2e-3)


def test_common_noise_factor_is_marginalised(problem, points):
    uncertain = problem_of(unit_of(0, rate=0.2), KNOWN_NOISE, blocks_per_segment=30, dof=12.0)
    z = points[:2, : uncertain.dimension]
    chi2 = (uncertain.residuals(z)[0] ** 2).sum(axis=1)
    n, nu = uncertain.dof, 12.0
    logs = []
    for value in chi2:
        # Variance factor f: scaled inverse chi-square prior of nu degrees of freedom times the Gaussian.
        def density(log_f, value=value):
            return -0.5 * (n + nu) * log_f - 0.5 * (value + nu) * np.exp(-log_f)

        top = np.log((value + nu) / (n + nu))
        area = quad(lambda x, d=density, t=top: np.exp(d(x) - d(t)), top - 3, top + 3, points=[top])[0]
        logs.append(density(top) + np.log(area))
    assert np.diff(logs)[0] == pytest.approx(np.diff(uncertain.log_likelihood(z))[0], rel=1e-6)


def test_the_state_space_form_is_the_dense_one():
    n, rng = 300, np.random.default_rng(2)
    columns = rng.normal(0, 1e-4, (n, 3))
    dense = np.linalg.solve(raw_covariance(n, 1e-3, KNOWN_NOISE), columns)
    white = kalman_whiten(columns, 1e-3, KNOWN_NOISE)
    np.testing.assert_allclose(white.T @ white, columns.T @ dense, rtol=1e-9, atol=1e-9)
    ones = np.ones((n, 1))
    free = without_offset(white, kalman_whiten(ones, 1e-3, KNOWN_NOISE)[:, 0])
    inverse = np.linalg.inv(raw_covariance(n, 1e-3, KNOWN_NOISE) + 1e-2)
    np.testing.assert_allclose(free.T @ free, columns.T @ inverse @ columns, rtol=1e-4, atol=1e-4)


def test_log_posterior_adds_the_standard_normal_prior(problem, points):
    expected = problem.log_likelihood(points) - 0.5 * (points**2).sum(axis=1)
    np.testing.assert_allclose(problem.log_posterior(points), expected, rtol=1e-12)
    many = np.tile(points, (7, 1))
    np.testing.assert_allclose(problem.log_posterior(many)[-12:], expected, rtol=1e-12)


def test_nan_of_a_model_raises(problem, points):
    with pytest.raises(FloatingPointError):
        problem.log_posterior(np.where(np.arange(points.shape[1]) == 0, np.nan, points))


def test_per_record_parameters_touch_their_own_record_only(problem, points):
    own = [i for i, c in enumerate(problem.coordinates) if c.record == 1]
    assert len(own) == 3 and len(set(problem.labels)) == problem.dimension
    moved = points.copy()
    moved[:, own] += 0.5
    before, after = problem.residuals(points), problem.residuals(moved)
    assert np.array_equal(before[0], after[0]) and np.abs(before[1] - after[1]).max() > 0.1
