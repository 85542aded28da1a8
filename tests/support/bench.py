"""Simulated records, their blocks, and the exact likelihood of raw samples, for the tests of inference."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from backdrive_bayes.bench.known_truth import BenchNoise, simulate_unit
from backdrive_bayes.inference.problem import Problem, RecordData
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.record import Unit
from backdrive_bayes.records.reduction import Blocks, reduce_record
from support.known import RATED, reducer, typical_values

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


def unit_of(seed=0, *, z=0.3, rate=0.05, noise=KNOWN_NOISE, amplitudes=(RATED,), **changes) -> Unit:
    """A simulated unit of the baseline, one record an amplitude; ``changes`` replace values."""
    model = reducer()
    values = typical_values(model, z) | changes
    loops = [(a, rate) for a in amplitudes]
    return simulate_unit(model, [values] * len(loops), loops, noise, np.random.default_rng(seed))


def problem_of(unit, noise: BenchNoise, blocks_per_segment=120, dof=1e9) -> Problem:
    """The problem of a unit with the noise held at its known values."""
    estimate, records = known_estimate(noise, dof), []
    for record in unit.records:
        segments = find_segments(record.time_s, record.torque_nm)
        records.append(
            RecordData.prepare(reduce_record(record, segments, estimate, blocks_per_segment), estimate)
        )
    return Problem(reducer(), tuple(records))


def even_blocks(samples, size, step_s=1e-3) -> Blocks:
    """Blocks of ``size`` samples each on one rising leg; torque and angle are left at zero."""
    edges = np.arange(0, samples + 1, size)
    n, count = edges.size - 1, np.diff(edges)
    begin = (edges[:-1] - 0.5) * step_s
    return Blocks(
        "even", np.zeros(n), np.zeros(n), np.zeros(n), begin, begin + count * step_s, count,
        np.zeros(n, int), np.array([0.0, 1.0]), np.array([1]), np.zeros(n),
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


def kalman_whiten(columns, step_s, noise: BenchNoise):
    """Standardised innovations (samples, columns) of the exact O(N) state-space form of the raw noise."""
    phi = np.exp(-step_s / noise.correlation_time_s)
    state, spread = np.zeros(columns.shape[1]), noise.correlated_rad**2
    out = np.empty_like(columns)
    for k, row in enumerate(columns):
        total = spread + noise.white_rad**2
        error = row - state
        out[k] = error / np.sqrt(total)
        gain = spread / total
        state = phi * (state + gain * error)
        spread = phi**2 * spread * (1 - gain) + noise.correlated_rad**2 * (1 - phi**2)
    return out


def without_offset(white, ones):
    """Whitened columns with the flat-prior offset marginalised."""
    ones = ones / np.linalg.norm(ones)
    return white - np.outer(ones, ones @ white)


@dataclass(frozen=True)
class Laplace:
    """Mode and covariance of the posterior, to state distances in posterior standard deviations."""

    mode: np.ndarray
    covariance: np.ndarray

    def points(self, rng, n):
        """Draws (n, dimension) and their coordinates in standard deviations along the principal axes."""
        value, vector = np.linalg.eigh(self.covariance)
        unit = rng.standard_normal((n, value.size))
        return self.mode + (unit * np.sqrt(value)) @ vector.T, unit


def quadratic_difference(unit, difference):
    """Shift of the mode in sd and relative change of the precision that a log-density difference means."""
    n, d = unit.shape
    i, j = np.triu_indices(d)
    design = np.column_stack([np.ones(n), unit, unit[:, i] * unit[:, j]])
    found = np.linalg.lstsq(design, difference, rcond=None)[0]
    curvature = np.zeros((d, d))
    curvature[i, j] = -found[1 + d :]
    return found[1 : 1 + d], curvature + curvature.T
