"""Both sides of the noise model's claim: white noise on raw samples, independent blocks, exact blocks.

The problem is the real model made linear in three of its parameters, under correlated noise, many times over.
"""

import numpy as np
import pytest
from scipy.stats import binom
from support.bench import block_means, even_blocks, known_estimate, noise_paths
from support.known import RATED, reducer, typical_values

from backdrive_bayes.bench.known_truth import BenchNoise
from backdrive_bayes.inference.covariance import block_covariance
from backdrive_bayes.model.path import TorquePath

NOISE = BenchNoise(white_rad=1e-5, correlated_rad=7e-5, correlation_time_s=0.03)
SAMPLES, SIZE, RUNS, LEVEL = 3000, 60, 400, 0.9
PARAMETERS = ("clearance", "compliance", "friction_torque")
NORMAL_90 = 1.6448536269514722


def directions():
    """Derivatives of the angle by the offset and three parameters on a rising branch, (samples, 4)."""
    model, torque = (
        reducer(),
        np.r_[0.0, np.linspace(RATED, -RATED, 200), np.linspace(-RATED, RATED, SAMPLES)],
    )
    path, centre = TorquePath.from_samples(torque), typical_values(reducer())
    columns = [np.ones(SAMPLES)]
    for name in PARAMETERS:
        pair = [
            model.angle({k: np.array([v * (1 + h * (k == name))]) for k, v in centre.items()}, path)
            for h in (0.01, -0.01)
        ]
        columns.append((pair[0] - pair[1])[-SAMPLES:] / 0.02)
    return np.array(columns).T


def generalised(design, data, covariance):
    """Generalised least squares: estimates (runs, parameters) and their claimed standard deviations."""
    weighted = np.linalg.solve(covariance, design)
    claim = np.linalg.inv(design.T @ weighted)
    return data @ weighted @ claim, np.sqrt(np.diag(claim))


def estimates(way):
    """Errors and claimed standard deviations of the three parameters in every run, the truth being zero."""
    design, noise = directions(), noise_paths(np.random.default_rng(8), (RUNS, SAMPLES), 1e-3, NOISE)
    if way == "white raw":
        variance = NOISE.white_rad**2 + NOISE.correlated_rad**2
        basis, upper = np.linalg.qr(design)
        inverse = np.linalg.inv(upper)
        found, sd = noise @ basis @ inverse.T, np.sqrt(variance * np.diag(inverse @ inverse.T))
    else:
        covariance = block_covariance(even_blocks(SAMPLES, SIZE), known_estimate(NOISE))
        if way == "independent blocks":
            covariance = np.diag(np.diag(covariance))
        found, sd = generalised(block_means(design.T, SIZE).T, block_means(noise, SIZE), covariance)
    return found[:, 1:], sd[1:]


def coverage(way):
    """How many of the runs' central 90 % intervals hold the truth, per parameter."""
    error, sd = estimates(way)
    return (np.abs(error) < NORMAL_90 * sd).sum(axis=0)


LOW, HIGH = binom.interval(0.999, RUNS, LEVEL)


def test_exact_blocks_cover():
    hits = coverage("exact blocks")
    assert ((hits >= LOW) & (hits <= HIGH)).all(), hits / RUNS


def test_white_noise_on_raw_samples_covers_far_too_little():
    assert (coverage("white raw") < 0.4 * RUNS).all()


def test_independent_blocks_cover_too_little():
    assert (coverage("independent blocks") < LOW).all()


@pytest.mark.parametrize(
    ("way", "low", "high"),
    [("white raw", 0.1, 0.3), ("independent blocks", 0.6, 0.9), ("exact blocks", 0.92, 1.08)],
)
def test_claimed_against_true_standard_deviation(way, low, high):
    error, sd = estimates(way)
    claimed = sd / error.std(axis=0)
    assert ((claimed > low) & (claimed < high)).all(), claimed
