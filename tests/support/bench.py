"""Simulated records, blocks and noise, for the tests of noise and covariance."""

import numpy as np
from scipy.signal import lfilter

from backdrive_bayes.bench.known_truth import BenchNoise, physical_reducer, simulate_unit
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.record import Unit
from backdrive_bayes.records.reduction import Blocks

KNOWN_NOISE = BenchNoise()


def known_estimate(noise: BenchNoise, dof=1e9):
    """The truth about the noise in the shape of an estimate."""
    return NoiseEstimate(
        noise.white_rad,
        noise.correlated_rad,
        noise.correlation_time_s,
        noise.torque_nm,
        0.0,
        0.0,
        0.0,
        0.0,
        dof,
    )


def unit_of(seed=0, *, rate=0.05, noise=KNOWN_NOISE, amplitudes=(0.1,), **changes) -> Unit:
    """A simulated unit of a known reducer, one record an amplitude; ``changes`` are of the reducer."""
    known = physical_reducer(np.random.default_rng(0), **({"scatter": 0.0} | changes))
    return simulate_unit(known, [(a, rate) for a in amplitudes], noise, np.random.default_rng(seed))


def path_of(begin, end, leg, torque, turning, trend=0.0) -> dict:
    """The last fields of Blocks: a torque that is straight from turning points to the middles of blocks."""
    ends = np.array([end[leg == k][-1] for k in np.unique(leg)])
    time, level = np.r_[begin[0], ends, 0.5 * (begin + end)], np.r_[turning, torque]
    along = np.argsort(time, kind="stable")
    return {"torque_trend_nm2": trend + np.zeros(begin.size), "path_s": time[along], "path_nm": level[along]}


def even_blocks(samples, size, step_s=1e-3) -> Blocks:
    """Blocks of ``size`` samples each on one rising leg; torque and angle are left at zero."""
    edges = np.arange(0, samples + 1, size)
    n, count = edges.size - 1, np.diff(edges)
    begin = (edges[:-1] - 0.5) * step_s
    return Blocks(
        "even", np.zeros(n), np.zeros(n), np.zeros(n), begin, begin + count * step_s, count,
        np.zeros(n, int), np.array([0.0, 1.0]), np.array([1]), np.zeros(n),
        **path_of(begin, begin + count * step_s, np.zeros(n, int), np.zeros(n), np.array([0.0, 1.0])),
    )  # fmt: skip


def block_means(x, size):
    """Means over blocks of ``size`` along the last axis."""
    return x[..., : x.shape[-1] // size * size].reshape(*x.shape[:-1], -1, size).mean(axis=-1)


def noise_paths(rng, shape, step_s, noise: BenchNoise):
    """Stationary Ornstein-Uhlenbeck plus white noise, one series along the last axis."""
    phi = np.exp(-step_s / noise.correlation_time_s)
    drive = rng.standard_normal(shape) * np.sqrt(1 - phi**2)
    drive[..., 0] = rng.standard_normal(shape[:-1])
    return noise.correlated_rad * lfilter(
        [1], [1, -phi], drive, axis=-1
    ) + noise.white_rad * rng.standard_normal(shape)


def raw_covariance(samples, step_s, noise: BenchNoise):
    lag = np.abs(np.subtract.outer(np.arange(samples), np.arange(samples))) * step_s
    return noise.correlated_rad**2 * np.exp(-lag / noise.correlation_time_s) + noise.white_rad**2 * np.eye(
        samples
    )
