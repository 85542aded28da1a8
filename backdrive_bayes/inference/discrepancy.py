"""Model discrepancy: a Gaussian process along the loop, orthogonal to the parameters' own directions.

Reality is the model plus a smooth function of the position on the loop. The function is a random Fourier series on the
closed loop (its coordinate grows evenly with torque, with angle and with the logarithm of torque, so that cliffs and the
neighbourhood of zero torque get their share), plus cusps at its tips, where friction turns over within a few per cent of the
torque, plus a series of its own on the first leg. Taking out the parameters' directions
keeps their meaning (Plumlee 2017, doi:10.1080/01621459.2016.1211016); scale and length maximise the evidence of the
residual.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from backdrive_bayes.inference.optimum import Optimum
from backdrive_bayes.inference.problem import Problem
from backdrive_bayes.model.path import TorquePath

HARMONICS = 72
FIRST_LEG_TERMS = 16
CUSPS = np.array([0.01, 0.03, 0.1])
"""Widths, in loops, of the cusps that the discrepancy may have at either tip; no narrower than blocks can see."""
CUSP_SHARE = 0.3
"""Prior standard deviation of a cusp, relative to that of the smooth part."""
WIDTH = 2 * HARMONICS + 2 * CUSPS.size + FIRST_LEG_TERMS
"""Terms of one record."""
LENGTHS = np.array([0.01, 0.03, 0.1, 0.3])
ROUGHNESS = (1.0, 2.0)
"""Spectral exponents: Matérn-1/2, which may have kinks, and Matérn-3/2, which is smooth."""
RELATIVE_SCALES = np.geomspace(1e-5, 0.3, 31)
WORTHWHILE = 4.0
"""Log evidence that a discrepancy must gain: the best of a grid of scales and lengths gains some from noise alone."""
PROBE = 1e-4
SETTLING_CYCLES = 3


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
        path = settled_path(half, problem.loading_rate_nm_per_s(record))
        angle = problem.model.reducer.angle(problem.values(z, record), path)[-2 * half.size + 1 :]
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


def settled_path(half_nm, rate_nm_per_s: float = 1.0) -> TorquePath:
    """A settled cycle along the rising torques ``half_nm`` (points,); the last 2·points − 1 samples are the loop.

    The cycles before it pass from tip to tip, for what a unit remembers of its past may outlive one tip.
    """
    ends = half_nm[[-1, 0]]
    torque = np.concatenate([[0.0], *[ends] * SETTLING_CYCLES, half_nm[::-1], half_nm[1:]])
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(torque)))]) / rate_nm_per_s
    return TorquePath.from_samples(torque, time)


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The Gaussian process, its hyperparameters, and what conditions it on a residual.

    ``scale_rad`` is the prior standard deviation on the largest loop, ``length`` the length scale in loops, ``roughness`` the
    spectral exponent, ``gain`` the log evidence against no discrepancy, ``relative`` (records,) the scale of each record's loop
    against the largest. ``conditioner`` (blocks, terms) turns whitened residuals into mean coefficients, ``factor`` (terms,
    terms) is a square root of their covariance. ``absorber`` (blocks, rank) spans what the discrepancy takes out of χ², which
    is ``misfit`` at the mode.
    """

    coordinates: tuple[LoopCoordinate, ...]
    optimum: Optimum
    scale_rad: float
    length: float
    roughness: float
    gain: float
    relative: np.ndarray
    absorbed: np.ndarray
    conditioner: np.ndarray
    factor: np.ndarray
    absorber: np.ndarray
    misfit: float

    @property
    def present(self) -> bool:
        """Whether there is any discrepancy."""
        return self.scale_rad > 0

    def mean(self, problem: Problem, z) -> np.ndarray:
        """Mean coefficients given coordinates ``z`` (…, dimension), shape (…, terms)."""
        return np.concatenate(problem.residuals(z), axis=-1) @ self.conditioner

    def draw(self, problem: Problem, z, rng) -> np.ndarray:
        """Coefficients given each of ``z`` (draws, dimension), shape (draws, terms)."""
        terms = self.factor.shape[0]
        if not self.present:
            return np.zeros((len(z), terms))
        mean = np.concatenate([self.mean(problem, part) for part in np.array_split(z, max(1, len(z) // 500))])
        return mean + rng.standard_normal((len(z), terms)) @ self.factor.T

    def raw_basis(self, record: int, path: TorquePath) -> np.ndarray:
        """One record's own basis before the parameters' directions are taken out, shape (samples, terms of a record)."""
        return _basis(self.coordinates[record], path, first_leg=True)

    def basis_on(self, problem: Problem, record: int, path: TorquePath, first_leg=False, model=None) -> np.ndarray:
        """Orthogonal basis at the samples of ``path`` in the state of ``record``, shape (samples, terms).

        ``model`` (default: the problem's own) is the part of the model whose angle the basis belongs to.
        """
        raw = _basis(self.coordinates[record], path, first_leg)
        full = np.zeros((raw.shape[0], self.factor.shape[0]))
        full[:, record * WIDTH : (record + 1) * WIDTH] = raw
        return full - angle_jacobian(problem, self.optimum.z, record, path, model) @ self.absorbed


def angle_jacobian(problem: Problem, z, record: int, path: TorquePath, model=None) -> np.ndarray:
    """Derivative of the angle [rad] of the whole model, or of ``model``, by the coordinates, shape (samples, dimension)."""
    probes = np.concatenate([z + PROBE * np.eye(z.size), z - PROBE * np.eye(z.size)])
    angle = (model or problem.model).angle(problem.values(probes, record), path)
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
    span = np.array([np.ptp(d.blocks.angle_rad) for d in problem.records])
    relative = span / span.max()
    # Structure shorter than the noise's own memory cannot be told from noise.
    shortest = max(3 * d.noise.correlation_time_s / _loop_time_s(d) for d in problem.records)
    lengths = LENGTHS[LENGTHS >= min(shortest, LENGTHS[-1])]
    scale, length, roughness, gain = _most_evident(problem, basis, residual, relative, span.max(), lengths)
    deviation = scale * np.concatenate([share * prior_deviation(length, roughness) for share in relative])
    value, vector = np.linalg.eigh(deviation[:, None] * (basis.T @ basis) * deviation)
    value = np.maximum(value, 0.0)
    root = (deviation[:, None] * vector) / np.sqrt(1 + value)
    seen = value > 1e-4
    absorber = basis @ root[:, seen]
    conditioner = absorber @ root[:, seen].T
    misfit = float(np.sum((absorber.T @ residual) ** 2))
    return Discrepancy(
        coordinates, optimum, scale, length, roughness, gain, relative, absorbed, conditioner, root, absorber, misfit
    )


def _loop_time_s(data):
    """Duration of one full loop at the record's mean rate [s]."""
    turning = data.blocks.turning_nm
    return 2 * np.ptp(turning) * (data.blocks.end_s[-1] - data.blocks.begin_s[0]) / np.abs(np.diff(turning)).sum()


def _basis(coordinate, path, first_leg):
    """Fourier terms on the loop, cusps at its tips, and cosine terms on the first leg, shape (samples, terms)."""
    phase = coordinate.phase(path.torque_nm, path.direction)
    angle = 2 * np.pi * np.arange(1, HARMONICS + 1) * phase[:, None]
    first = np.zeros((phase.size, FIRST_LEG_TERMS))
    if first_leg:
        stop = path.legs[0].stop
        along = 2 * np.abs(phase[:stop] - phase[0])
        first[:stop] = np.cos(np.pi * np.arange(FIRST_LEG_TERMS) * along[:, None])
    apart = np.abs(phase[:, None] - np.array([0.0, 0.5]))
    apart = np.minimum(apart, 1 - apart)
    cusps = np.exp(-apart[:, :, None] / CUSPS).reshape(phase.size, -1)
    return np.concatenate([np.cos(angle), np.sin(angle), cusps, first], axis=1)


def prior_deviation(length: float, roughness: float) -> np.ndarray:
    """Prior standard deviation of one record's coefficients for unit scale, shape (terms,), of a Matérn spectrum."""
    loop = (1 + (2 * np.pi * np.arange(1, HARMONICS + 1) * length) ** 2) ** -roughness
    first = (1 + (np.pi * np.arange(FIRST_LEG_TERMS) * length) ** 2) ** -roughness
    cusps = np.full(2 * CUSPS.size, CUSP_SHARE**2)
    return np.sqrt(np.concatenate([loop / loop.sum(), loop / loop.sum(), cusps, first / first.sum()]))


def _whitened_basis(problem, coordinates):
    blocks = [d.blocks.angle_rad.size for d in problem.records]
    basis = np.zeros((sum(blocks), WIDTH * len(blocks)))
    row = 0
    for r, (data, coordinate) in enumerate(zip(problem.records, coordinates, strict=True)):
        raw = _basis(coordinate, data.path, first_leg=True)
        basis[row : row + blocks[r], r * WIDTH : (r + 1) * WIDTH] = data.whitener @ raw
        row += blocks[r]
    return basis


def _most_evident(problem, basis, residual, relative, span, lengths):
    """Scale [rad], length, roughness and gain in log evidence over no discrepancy, the best of a grid.

    For the choice alone, the small couplings between records that orthogonality brings are left out.
    """
    row, parts = 0, []
    for r, data in enumerate(problem.records):
        n = data.blocks.angle_rad.size
        own = basis[row : row + n, r * WIDTH : (r + 1) * WIDTH]
        parts.append((own.T @ own, own.T @ residual[row : row + n]))
        row += n
    scale2 = (span * RELATIVE_SCALES[:, None]) ** 2
    best = (0.0, lengths[0], ROUGHNESS[0], 0.0)
    for roughness in ROUGHNESS:
        for length in lengths:
            one, gain = prior_deviation(length, roughness), np.zeros(RELATIVE_SCALES.size)
            for share, (gram, projection) in zip(relative, parts, strict=True):
                deviation = share * one
                value, vector = np.linalg.eigh(deviation[:, None] * gram * deviation)
                spread = 1 + scale2 * np.maximum(value, 0.0)
                load = (vector.T @ (deviation * projection)) ** 2
                gain += 0.5 * np.sum(scale2 * load / spread - np.log(spread), axis=1)
            k = int(np.argmax(gain))
            if gain[k] > max(best[3], WORTHWHILE):
                best = (float(span * RELATIVE_SCALES[k]), float(length), roughness, float(gain[k]))
    return best
