"""One unit made ready for diagnosis: reduced, its noise known, the baseline fitted, covariances of misfit at hand."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, cholesky, solve_triangular

from backdrive_bayes.gap.kernels import Places
from backdrive_bayes.inference.fit import prepare
from backdrive_bayes.inference.problem import Problem
from backdrive_bayes.records.faults import without_wild
from backdrive_bayes.records.record import Unit

MOST_BLOCKS = 640
MISFIT_LENGTH = 0.06


@dataclass(frozen=True, eq=False)
class JointProblem(Problem):
    """A problem whose records are whitened together, because their misfit is partly common."""

    whitener: np.ndarray | None = None

    def residuals(self, z) -> list[np.ndarray]:
        """Whitened residuals of all records, one array of shape (…, blocks)."""
        return [np.matmul(self.raw_residual(z), self.whitener.T)]

    def raw_residual(self, z) -> np.ndarray:
        """Measured less modelled angle [rad] of all records one after another, shape (…, blocks)."""
        physical = self.physical(z)
        parts = [d.blocks.angle_rad - self.model.angle(self._named(physical, r), d.path) for r, d in enumerate(self.records)]
        return np.concatenate(parts, axis=-1)


@dataclass(frozen=True, eq=False)
class Whitening:
    """Whitener of one covariance (blocks, blocks) with the offsets of the records projected out."""

    matrix: np.ndarray

    @classmethod
    def of(cls, covariance: np.ndarray, record: np.ndarray) -> Whitening:
        """From a covariance (blocks, blocks) and the record of each block."""
        lower = cholesky(covariance, lower=True, check_finite=False)
        white = solve_triangular(lower, np.eye(lower.shape[0]), lower=True, check_finite=False)
        basis = np.linalg.qr(white @ (record[:, None] == np.arange(record.max() + 1)).astype(float))[0]
        return cls(white - basis @ (basis.T @ white))


@dataclass(frozen=True, eq=False)
class Setting:
    """The baseline's problem and mode, the noise covariance (blocks, blocks) and the places of the blocks."""

    unit: Unit
    problem: Problem
    z: np.ndarray
    noise: np.ndarray
    noise_rad: float
    places: Places
    _kept: dict = field(default_factory=dict)

    @classmethod
    def of(cls, unit: Unit, rng, baseline) -> Setting:
        """Leave wild samples out, reduce, fit the baseline, tell noise from misfit."""
        unit = without_wild(unit)
        per_segment = int(np.clip(MOST_BLOCKS / (2.5 * len(unit.records)), 40, 110))
        prepared = prepare(unit, rng, baseline, blocks_per_segment=per_segment)
        problem = prepared.problem
        noise = block_diag(*[d.covariance for d in problem.records])
        z = prepared.optimum.z
        return cls(unit, problem, z, noise, float(np.sqrt(np.median(np.diag(noise)))), Places(problem, z))

    def whitening(self, *terms) -> Whitening:
        """Whitener for :meth:`covariance`."""
        return Whitening.of(self.covariance(*terms), self.places.record)

    def covariance(self, *terms) -> np.ndarray:
        """What every hypothesis has in common, and more, (blocks, blocks).

        ``terms`` are (kernel name, length, standard deviation in noise units) each.
        """
        covariance = self.common.copy()
        for name, length, deviation in terms:
            covariance += (deviation * self.noise_rad) ** 2 * self.kernel(name, length)
        return covariance

    @cached_property
    def common(self) -> np.ndarray:
        """Covariance (blocks, blocks) of noise, torque ripple and sharp misfit [rad²]."""
        return self.noise + self.places.torque_ripple() + self.noise_rad**2 * self.kernel("sharp", MISFIT_LENGTH)

    def kernel(self, name: str, length: float) -> np.ndarray:
        """Covariance of the given kind (a method of ``Places``), of unit variance in the widest record."""
        if (name, length) not in self._kept:
            self._kept[name, length] = getattr(self.places, name)(length)
        return self._kept[name, length]
