"""Model discrepancy: a Gaussian process along the loop, orthogonal to the parameters' own directions.

Reality is the model plus a smooth function of the position on the loop. The function is a random Fourier series on the closed loop
(its coordinate grows evenly with torque, with angle and with the logarithm of torque, so that cliffs and the neighbourhood of
zero torque get their share), plus a series of its own on the first
leg. Taking out the parameters' directions keeps their meaning (Plumlee 2017, doi:10.1080/01621459.2016.1211016); scale and length
maximise the evidence of the residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from backdrive_bayes.inference.optimum import Optimum
from backdrive_bayes.inference.problem import Problem
from backdrive_bayes.model.path import TorquePath

HARMONICS = 72
FIRST_LEG_TERMS = 16
LENGTHS = np.array([0.01, 0.03, 0.1, 0.3])
ROUGHNESS = (1.0, 2.0)
"""Spectral exponents: Matérn-1/2, which may have kinks, and Matérn-3/2, which is smooth."""
RELATIVE_SCALES = np.geomspace(3e-5, 0.3, 9)
PROBE = 1e-4


@dataclass(frozen=True, eq=False)
class LoopCoordinate:
    """Position on the settled loop of one record: phase 0 at +T, 1/2 at -T, shared by all its cycles."""

    torque_nm: np.ndarray
    falling: np.ndarray
    rising: np.ndarray

    @classmethod
    def of(cls, problem: Problem, z, record: int) -> LoopCoordinate:
        """From the model's own settled loop at coordinates ``z``."""
        amplitude = amplitude_nm(problem, record)
        half = amplitude * np.sinh(np.linspace(-3, 3, 201)) / np.sinh(3)
        path = settled_path(half)
        angle = problem.model.angle(problem.values(z, record), path)[-2 * half.size + 1 :]
        falling, rising = angle[: half.size][::-1], angle[half.size - 1 :]
        return cls(half, _progress(half, falling), _progress(half, rising))

    def phase(self, torque, direction):
        """Phase in [0, 1) of torques [N·m] on branches of the given directions, both (samples,)."""
        down = 0.5 * (1 - np.interp(torque, self.torque_nm, self.falling))
        up = 0.5 + 0.5 * np.interp(torque, self.torque_nm, self.rising)
        return np.where(direction > 0, up, down)


def _progress(torque, angle):
    angle = np.maximum.accumulate(angle)
    near_zero = np.arcsinh(torque / (0.03 * torque[-1]))
    return sum((x - x[0]) / max(np.ptp(x), 1e-300) for x in (torque, angle, near_zero)) / 3


def amplitude_nm(problem: Problem, record: int) -> float:
    """Amplitude T of a record's loop: half the span of its turning torques [N·m]."""
    return 0.5 * float(np.ptp(problem.records[record].blocks.turning_nm))


def settled_path(half_nm) -> TorquePath:
    """0 → +T → −T → +T along the rising torques ``half_nm`` (points,); the last 2·points − 1 samples are the loop."""
    start = half_nm[half_nm > 0]
    return TorquePath.from_samples(np.concatenate([[0.0], start, half_nm[::-1][1:], half_nm[1:]]))


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """Posterior of the discrepancy's coefficients and what is needed to evaluate it anywhere on the loops.

    ``scale_rad`` is the prior standard deviation of the largest loop, ``length`` the length scale in loops, ``roughness`` the spectral exponent, ``gain`` the log
    evidence against no discrepancy, ``misfit`` the part of χ² that it explains,
    ``relative`` (records,) the scale of each record's loop against the largest.
    """

    coordinates: tuple[LoopCoordinate, ...]
    optimum: Optimum
    scale_rad: float
    length: float
    roughness: float
    gain: float
    mean: np.ndarray
    factor: np.ndarray
    absorbed: np.ndarray
    misfit: float
    relative: np.ndarray

    @property
    def present(self) -> bool:
        """Whether there is any discrepancy."""
        return self.scale_rad > 0

    def draw(self, rng, draws: int) -> np.ndarray:
        """Coefficients of shape (draws, terms)."""
        return self.mean + rng.normal(size=(draws, self.mean.size)) @ self.factor.T

    def raw_basis(self, record: int, path: TorquePath) -> np.ndarray:
        """One record's own basis before the parameters' directions are taken out, shape (samples, terms of a record)."""
        return _basis(self.coordinates[record], path, first_leg=True)

    def basis_on(self, problem: Problem, record: int, path: TorquePath, first_leg=False) -> np.ndarray:
        """Orthogonal basis at the samples of ``path`` in the state of ``record``, shape (samples, terms)."""
        raw = _basis(self.coordinates[record], path, first_leg)
        width = raw.shape[1]
        full = np.zeros((raw.shape[0], self.mean.size))
        full[:, record * width : (record + 1) * width] = raw
        return full - angle_jacobian(problem, self.optimum.z, record, path) @ self.absorbed


def angle_jacobian(problem: Problem, z, record: int, path: TorquePath) -> np.ndarray:
    """Derivative of the model's angle [rad] by the coordinates, shape (samples, dimension)."""
    probes = np.concatenate([z + PROBE * np.eye(z.size), z - PROBE * np.eye(z.size)])
    angle = problem.model.angle(problem.values(probes, record), path)
    return (angle[: z.size] - angle[z.size :]).T / (2 * PROBE)


def learn_discrepancy(problem: Problem, optimum: Optimum) -> Discrepancy:
    """Scale and length by evidence, coefficients by conditioning, from the residual at the posterior mode."""
    coordinates = tuple(LoopCoordinate.of(problem, optimum.z, r) for r in range(len(problem.records)))
    residual = np.concatenate(problem.residuals(optimum.z))
    jacobian = optimum.jacobian
    basis = _whitened_basis(problem, coordinates)
    normal = cho_factor(np.eye(optimum.z.size) + jacobian.T @ jacobian)
    # jacobian = d(residual)/dz = -d(angle)/dz, hence the sign.
    absorbed = -cho_solve(normal, jacobian.T @ basis)
    basis = basis + jacobian @ absorbed
    gram, projection = basis.T @ basis, basis.T @ residual
    span = np.array([np.ptp(d.blocks.angle_rad) for d in problem.records])
    relative = span / span.max()
    # Structure shorter than the noise's own memory cannot be told from noise.
    shortest = max(3 * d.noise.correlation_time_s / _loop_time_s(d) for d in problem.records)
    lengths = LENGTHS[LENGTHS >= min(shortest, LENGTHS[-1])]
    scale, length, roughness, gain = _most_evident(gram, projection, relative, span.max(), lengths)
    terms = projection.size
    if gain <= 0:
        zero = np.zeros(terms)
        return Discrepancy(coordinates, optimum, 0.0, length, roughness, 0.0, zero, np.zeros((terms, terms)), absorbed, 0.0, relative)
    deviation = scale * _shape(length, roughness, relative)
    lower = np.linalg.cholesky(np.eye(terms) + deviation[:, None] * gram * deviation)
    factor = deviation[:, None] * solve_triangular(lower, np.eye(terms), lower=True).T
    mean = factor @ (factor.T @ projection)
    misfit = max(float(projection @ mean), 0.0)
    return Discrepancy(coordinates, optimum, scale, length, roughness, gain, mean, factor, absorbed, misfit, relative)


def fitted_at_blocks(problem: Problem, discrepancy: Discrepancy, record: int) -> np.ndarray:
    """Mean discrepancy at the blocks of a record [rad], shape (blocks,)."""
    data = problem.records[record]
    return discrepancy.basis_on(problem, record, data.path, first_leg=True) @ discrepancy.mean


def _loop_time_s(data):
    """Duration of one full loop at the record's mean rate [s]."""
    turning = data.blocks.turning_nm
    return 2 * np.ptp(turning) * (data.blocks.end_s[-1] - data.blocks.begin_s[0]) / np.abs(np.diff(turning)).sum()


def _basis(coordinate, path, first_leg):
    """Fourier terms on the loop, and cosine terms on the first leg, shape (samples, terms)."""
    phase = coordinate.phase(path.torque_nm, path.direction)
    angle = 2 * np.pi * np.arange(1, HARMONICS + 1) * phase[:, None]
    first = np.zeros((phase.size, FIRST_LEG_TERMS))
    if first_leg:
        stop = path.legs[0].stop
        along = 2 * np.abs(phase[:stop] - phase[0])
        first[:stop] = np.cos(np.pi * np.arange(FIRST_LEG_TERMS) * along[:, None])
    return np.concatenate([np.cos(angle), np.sin(angle), first], axis=1)


def _shape(length, roughness, relative):
    one = prior_deviation(length, roughness)
    return np.concatenate([share * one for share in relative])


def prior_deviation(length: float, roughness: float) -> np.ndarray:
    """Prior standard deviation of one record's coefficients for unit scale, shape (terms,), of a Matérn spectrum."""
    loop = (1 + (2 * np.pi * np.arange(1, HARMONICS + 1) * length) ** 2) ** -roughness
    first = (1 + (np.pi * np.arange(FIRST_LEG_TERMS) * length) ** 2) ** -roughness
    return np.sqrt(np.concatenate([loop / loop.sum(), loop / loop.sum(), first / first.sum()]))


def _whitened_basis(problem, coordinates):
    blocks, width = [d.blocks.angle_rad.size for d in problem.records], 2 * HARMONICS + FIRST_LEG_TERMS
    basis = np.zeros((sum(blocks), width * len(blocks)))
    row = 0
    for r, (data, coordinate) in enumerate(zip(problem.records, coordinates, strict=True)):
        raw = _basis(coordinate, data.path, first_leg=True)
        basis[row : row + blocks[r], r * width : (r + 1) * width] = data.whitener @ raw
        row += blocks[r]
    return basis


def _most_evident(gram, projection, relative, span, lengths):
    """Scale [rad], length, roughness and gain in log evidence over no discrepancy, the best of a grid."""
    best = (0.0, lengths[0], ROUGHNESS[0], 0.0)
    for roughness in ROUGHNESS:
        for length in lengths:
            shape = _shape(length, roughness, relative)
            scaled, load = shape[:, None] * gram * shape, shape * projection
            for scale in span * RELATIVE_SCALES:
                lower = np.linalg.cholesky(np.eye(load.size) + scale**2 * scaled)
                explained = scale * solve_triangular(lower, load, lower=True)
                gain = 0.5 * explained @ explained - np.log(np.diag(lower)).sum()
                if gain > best[3]:
                    best = (float(scale), float(length), roughness, float(gain))
    return best
