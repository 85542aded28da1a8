"""Covariance of block means against the raw grid it averages over, and whitening with it."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import block_means, even_blocks, known_estimate, noise_paths, path_of, raw_covariance
from support.planted import planted

from backdrive_bayes.bench.known_truth import BenchNoise
from backdrive_bayes.engine import reduced as engine
from backdrive_bayes.engine.covariance import BEND_ERROR, channel_covariance, local_slope, path_covariance, whitener
from backdrive_bayes.engine.reduced import Jitter, reduce_unit
from backdrive_bayes.records.reduction import Blocks

NOISE = BenchNoise(white_rad=3e-5, correlated_rad=7e-5, correlation_time_s=0.03)
CUTS = np.array([0, 1, 2, 5, 30, 31, 90, 200, 600, 610])


def uneven_blocks(cuts, step_s=1e-3):
    n, count = cuts.size - 1, np.diff(cuts)
    begin = (cuts[:-1] - 0.5) * step_s
    variance = np.linspace(1e-9, 5e-9, n)
    leg = (np.arange(n) >= n // 2).astype(int)
    return Blocks(
        "uneven", np.zeros(n), np.zeros(n), variance, begin, begin + count * step_s, count, leg,
        np.array([0.0, 1.0, 0.0]), np.array([1, -1]), np.zeros(n),
        **path_of(begin, begin + count * step_s, leg, np.zeros(n), np.array([0.0, 1.0, 0.0])),
    )  # fmt: skip


def averaged(cuts, noise):
    """Brute force: the raw covariance matrix averaged over every pair of blocks."""
    average = np.zeros((cuts.size - 1, cuts[-1]))
    for k, (a, b) in enumerate(zip(cuts[:-1], cuts[1:], strict=True)):
        average[k, a:b] = 1 / (b - a)
    return average @ raw_covariance(cuts[-1], 1e-3, noise) @ average.T


def relative_gap(a, b):
    """Largest entry of the difference in units of the standard deviations."""
    sd = np.sqrt(np.diag(b))
    return np.abs((a - b) / np.outer(sd, sd)).max()


def block_covariance(blocks, noise, slope_rad_per_nm=0.0):
    """Both channels' parts."""
    return channel_covariance(blocks, noise) + path_covariance(blocks, slope_rad_per_nm)


def test_block_covariance_is_the_average_of_the_kernel():
    found = block_covariance(uneven_blocks(CUTS), known_estimate(NOISE))
    # A single sample passes for an average over its own step: 1 - step / (3 t_c), one per cent at 1 kHz.
    assert relative_gap(found, averaged(CUTS, NOISE)) < 0.012
    long = CUTS[CUTS >= 30] - 30
    assert (
        relative_gap(block_covariance(uneven_blocks(long), known_estimate(NOISE)), averaged(long, NOISE))
        < 0.012
    )


def test_independent_blocks_are_not_the_average_of_the_kernel():
    found = np.diag(np.diag(block_covariance(uneven_blocks(CUTS), known_estimate(NOISE))))
    assert relative_gap(found, averaged(CUTS, NOISE)) > 0.3


def test_coarse_sampling_has_the_covariance_of_its_samples():
    slow = BenchNoise(white_rad=0.0, correlated_rad=7e-5, correlation_time_s=1.5e-3)
    cuts = np.arange(20)
    assert (
        relative_gap(block_covariance(uneven_blocks(cuts), known_estimate(slow)), averaged(cuts, slow)) < 0.05
    )


def test_monte_carlo_block_means_have_the_covariance():
    size, runs = 60, 4000
    means = block_means(noise_paths(np.random.default_rng(0), (runs, 480), 1e-3, NOISE), size)
    white = whitener(block_covariance(even_blocks(480, size), known_estimate(NOISE))) @ means.T
    found = white @ white.T / runs
    error = np.sqrt((1 + np.eye(8)) / runs)
    assert (np.abs(found - np.eye(8)) < 4.5 * error).all()
    naive = (
        np.diag(1 / np.sqrt(np.diag(block_covariance(even_blocks(480, size), known_estimate(NOISE)))))
        @ means.T
    )
    assert (np.abs(naive @ naive.T / runs - np.eye(8)) > 4.5 * error).any(), (
        "independent blocks must fail this check"
    )


@pytest.mark.parametrize("samples", [1, 2, 500])
@pytest.mark.parametrize("ratio", [1e-4, 5e-3, 0.5, 20.0, 1e4])
def test_variance_of_one_block_over_all_lengths(ratio, samples):
    """A block of ``ratio`` correlation times against the mean of the kernel over all pairs of its samples."""
    step = ratio / samples
    lag = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples))) * step
    noise = BenchNoise(white_rad=0.0, correlated_rad=1.0, correlation_time_s=1.0 / step)
    found = block_covariance(uneven_blocks(np.array([0, samples]), step_s=1.0), known_estimate(noise))[0, 0]
    assert found == pytest.approx(np.exp(-lag).mean(), rel=1e-6)


def test_torque_noise_enters_through_the_slope():
    blocks, estimate = uneven_blocks(CUTS), known_estimate(NOISE)
    slope = np.linspace(0, 3, CUTS.size - 1)
    added = block_covariance(blocks, estimate, slope) - block_covariance(blocks, estimate)
    np.testing.assert_allclose(added, np.diag(slope**2 * blocks.torque_variance_nm2), atol=1e-20)


def test_a_corrected_mean_carries_part_of_its_correction_as_error():
    blocks, estimate = uneven_blocks(CUTS), known_estimate(NOISE)
    bent = replace(blocks, bend_rad=np.linspace(-1e-3, 2e-3, CUTS.size - 1))
    added = block_covariance(bent, estimate) - block_covariance(blocks, estimate)
    np.testing.assert_allclose(added, np.diag((BEND_ERROR * bent.bend_rad) ** 2), atol=1e-18)
    assert np.diag(added).max() > 1e-8


def test_whitener_whitens():
    covariance = block_covariance(uneven_blocks(CUTS), known_estimate(NOISE))
    white = whitener(covariance)
    np.testing.assert_allclose(white @ covariance @ white.T, np.eye(CUTS.size - 1), atol=1e-9)
    assert np.array_equal(white, np.tril(white))


def blocks_at(torque, error=0.0):
    """Blocks on one rising leg at given torques, the torque of each known to ``error``."""
    return replace(
        even_blocks(torque.size, 1), torque_nm=torque, torque_variance_nm2=np.full(torque.size, error**2), torque_trend_nm2=0.0
    )


def test_slopes_of_a_smooth_curve_are_its_derivative():
    torque = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 400))
    found = local_slope(blocks_at(torque), 1e-2 * torque**2)
    np.testing.assert_allclose(found[5:-5], 2e-2 * torque[5:-5], rtol=0.1, atol=1e-4)


def test_an_error_of_the_torque_moves_the_angle_no_further_than_its_step():
    """Secants over neighbours alone put the error at some fifty steps."""
    torque = np.linspace(0.0, 1.0, 500)
    blocks = blocks_at(torque, error=0.1)
    angle = np.where(torque > 0.5, 2e-2, 0.0)
    moved = local_slope(blocks, angle) * 0.1
    assert np.max(moved) <= 2e-2
    assert np.all(moved[np.abs(torque - 0.5) < 0.09] > 0.5e-2) and np.all(moved[np.abs(torque - 0.5) > 0.11] == 0.0)
    assert np.max(np.abs(np.gradient(angle) / np.gradient(torque))) * 0.1 > 20 * np.max(moved)


def test_slopes_stay_of_their_size_where_the_torque_stands_still_in_most_blocks():
    still = np.repeat(np.arange(10.0), 30)
    angle = np.linspace(0.0, 2e-2, still.size)
    smooth = local_slope(blocks_at(np.linspace(0.0, 9.0, still.size), error=0.1), angle)
    assert np.max(local_slope(blocks_at(still, error=0.1), angle)) < 10 * np.max(smooth)


def test_the_torque_zero_of_a_record_moves_all_its_blocks(monkeypatch):
    """Blocks far from each other, on legs of either direction, share the angle by which the slope answers a zero."""
    unit = reduce_unit(planted())
    slopes, noise, jitter = unit.read_slopes, unit.noise[0], Jitter(1e-6, 0.002)
    usual = unit.covariances(slopes, jitter)[0]
    monkeypatch.setattr(engine, "ZERO", 0.0)
    less = replace(unit).covariances(slopes, jitter)[0]
    shared = (0.5 * noise.torque_nm / unit.angle_scale_rad) ** 2 * np.outer(slopes[0], slopes[0])
    np.testing.assert_allclose(usual - less, shared, atol=1e-9 * shared.max())
