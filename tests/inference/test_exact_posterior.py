"""The posterior of reduced records against the exact one of all raw samples."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import (
    Laplace,
    kalman_whiten,
    known_estimate,
    problem_of,
    quadratic_difference,
    unit_of,
    without_offset,
)
from support.known import RATED

from backdrive_bayes.bench.known_truth import BenchNoise, ramp
from backdrive_bayes.inference.covariance import block_covariance
from backdrive_bayes.inference.fit import corrected_blocks
from backdrive_bayes.inference.optimum import find_optimum, laplace
from backdrive_bayes.inference.problem import RecordData
from backdrive_bayes.inference.starts import screened_starts
from backdrive_bayes.model.path import TorquePath

NOISE = BenchNoise(torque_nm=1e-12)
RATE = 5 * RATED / 6.0
POINTS = 500


def exact_log_likelihood(problem, unit, z, noise):
    """Ornstein-Uhlenbeck plus white, flat prior on the offset, every raw sample, shape (points,)."""
    record = unit.records[0]
    time, torque = ramp(RATED, RATE)
    path = TorquePath.from_samples(torque, time)
    residual = record.angle_rad - problem.model.angle(problem.values(z, 0), path)
    columns = np.concatenate([np.ones((1, time.size)), residual]).T
    white = kalman_whiten(columns, time[1] - time[0], noise)
    return -0.5 * (without_offset(white[:, 1:], white[:, 0]) ** 2).sum(axis=0)


@pytest.fixture(scope="module")
def exact():
    """Points about the mode, their coordinates in standard deviations, and the exact likelihood there."""
    unit = unit_of(5, rate=RATE, noise=NOISE, hardening_torque=0.5 * RATED)
    assert unit.records[0].time_s.size == 6001
    problem = problem_of(unit, NOISE)
    rng = np.random.default_rng(0)
    optimum = find_optimum(problem, screened_starts(problem, rng))
    z, unit_z = Laplace(optimum.z, optimum.covariance).points(rng, POINTS)
    return unit, z, unit_z, exact_log_likelihood(problem, unit, z, NOISE)


def disagreement(exact, problem):
    """Largest shift of the mean and change of the sd along a principal axis, in standard deviations."""
    _, z, unit_z, raw = exact
    shift, precision = quadratic_difference(unit_z, problem.log_likelihood(z) - raw)
    # The axes are those of the reduced posterior, whose precision is the unit matrix there.
    ratio = 1 / np.sqrt(np.maximum(np.linalg.eigvalsh(np.eye(shift.size) - precision), 1e-12))
    return np.abs(shift).max(), np.abs(ratio - 1).max()


def curvature_bias(blocks_per_segment, corrected=True):
    """Largest shift of a parameter, in its sd, that block averages of a noise-free record bring about.

    The correction is taken where the fit takes it: at the mode of the uncorrected problem.
    """
    quiet = BenchNoise(1e-15, 1e-15, 0.03, 1e-12)
    problem = problem_of(unit_of(5, rate=RATE, noise=quiet), NOISE, blocks_per_segment)
    truth = np.full(problem.dimension, 0.3)
    optimum = laplace(problem, truth)
    if corrected:
        mode = truth - optimum.covariance @ optimum.jacobian.T @ problem.residuals(truth)[0]
        data = problem.records[0]
        blocks = corrected_blocks(problem, mode, 0)
        problem = replace(problem, records=(RecordData.prepare(blocks, data.noise, path=data.path),))
        optimum = laplace(problem, truth)
    shift = -optimum.covariance @ optimum.jacobian.T @ problem.residuals(truth)[0]
    return np.abs(shift / np.sqrt(np.diag(optimum.covariance))).max()


def test_reduced_posterior_agrees_with_the_exact_one(exact):
    shift, spread = disagreement(exact, problem_of(exact[0], NOISE))
    # Blocks lose some of the information, most of it (a twentieth of the sd) along the shape of the step, which moves the mean by
    # the square root of that at most.
    assert spread < 0.08
    assert shift < 0.45


def test_finer_blocks_agree_better(exact):
    coarse = disagreement(exact, problem_of(exact[0], NOISE, blocks_per_segment=60))
    fine = disagreement(exact, problem_of(exact[0], NOISE, blocks_per_segment=400))
    assert fine[0] < coarse[0] and fine[1] < coarse[1]


def test_too_few_blocks_are_noticed(exact):
    shift, spread = disagreement(exact, problem_of(exact[0], NOISE, blocks_per_segment=15))
    assert shift > 0.45 and spread > 0.08


def test_independent_blocks_are_noticed(exact):
    """The same blocks with the off-diagonal covariance left out."""
    problem = problem_of(exact[0], NOISE)
    data = problem.records[0]
    estimate = known_estimate(NOISE)
    diagonal = 1 / np.sqrt(np.diag(block_covariance(data.blocks, estimate)))
    ones = diagonal / np.linalg.norm(diagonal)
    white = np.diag(diagonal) - np.outer(ones, ones @ np.diag(diagonal))
    naive = replace(problem, records=(replace(data, whitener=white),))
    assert disagreement(exact, naive)[1] > 0.08


@pytest.mark.parametrize("blocks_per_segment", [60, 120, 200])
def test_block_averages_bring_no_bias(blocks_per_segment):
    assert curvature_bias(blocks_per_segment) < 0.1


def test_bias_of_coarse_blocks_is_large():
    assert curvature_bias(15, corrected=False) > 1
