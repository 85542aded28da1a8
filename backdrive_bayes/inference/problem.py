"""The statistical problem of one unit: coordinates, residuals and the log posterior, vectorised over walkers.

All records share the model's parameters; parameters marked ``per_record`` and the encoder's offset belong to one record.
Offsets are marginalised exactly under a flat prior, a common factor on the noise variance under a scaled inverse-chi-square
prior that carries the uncertainty of the noise estimate (which makes the likelihood a Student-t). ``misfit`` is the
part of χ² that the model discrepancy explains at the mode; being orthogonal to the parameters' directions it is a constant.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from backdrive_bayes.inference.covariance import block_covariance, whitener
from backdrive_bayes.model.parameter import Parameter
from backdrive_bayes.model.path import Leg, TorquePath
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.reduction import Blocks

WALKERS_AT_ONCE = 128
"""Chunk of walkers whose intermediate arrays stay in the cache; found by measurement (studies/speed.py)."""

CHANNEL_NODES = 3
"""Points within a block at which a fast angle channel is followed: an odd number, so that one of them is the block's own."""


@dataclass(frozen=True, eq=False)
class RecordData:
    """One reduced record with its torque path and whitener, and how its encoder offset follows from a residual.

    ``offset_weight`` (blocks,) gives the generalised least-squares offset, ``offset_sd_rad`` its standard error.
    """

    blocks: Blocks
    noise: NoiseEstimate
    path: TorquePath
    covariance: np.ndarray
    whitener: np.ndarray
    offset_weight: np.ndarray
    offset_sd_rad: float

    @classmethod
    def prepare(cls, blocks: Blocks, noise: NoiseEstimate, slope_rad_per_nm=0.0, path=None) -> RecordData:
        """Whiten with the block covariance; ``slope_rad_per_nm`` as in ``block_covariance``."""
        covariance = block_covariance(blocks, noise, slope_rad_per_nm)
        white = whitener(covariance)
        ones = white.sum(axis=1)
        norm = np.linalg.norm(ones)
        ones = ones / norm
        weight = ones @ white / norm
        # Taking the offset's direction out of the whitener marginalises the offset under a flat prior.
        white = white - np.outer(ones, ones @ white)
        return cls(blocks, noise, path or path_of(blocks), covariance, white, weight, float(1 / norm))


def path_of(blocks: Blocks) -> TorquePath:
    """The torque path that drives the model at the blocks."""
    bounds = np.searchsorted(blocks.leg, np.arange(blocks.direction.size + 1))
    legs = tuple(
        Leg(int(a), int(b), int(d), float(t))
        for a, b, d, t in zip(bounds[:-1], bounds[1:], blocks.direction, blocks.turning_nm[1:], strict=True)
    )
    path = TorquePath(blocks.torque_nm, blocks.mid_s, float(blocks.turning_nm[0]), legs)
    return replace(path, within=path_within(blocks, path, CHANNEL_NODES))


def path_within(blocks: Blocks, path: TorquePath, nodes: int) -> TorquePath:
    """The path of some blocks at ``nodes`` evenly spaced points within each, straight between their middles."""
    share = (np.arange(nodes) + 0.5) / nodes
    time = blocks.begin_s[:, None] + (blocks.end_s - blocks.begin_s)[:, None] * share
    torque = np.empty_like(time)
    for k, leg in enumerate(path.legs):
        own = slice(leg.start, leg.stop)
        at = np.r_[blocks.begin_s[own][:1], blocks.mid_s[own], blocks.end_s[own][-1:]]
        torque[own] = np.interp(time[own], at, np.r_[blocks.turning_nm[k], blocks.torque_nm[own], blocks.turning_nm[k + 1]])
    legs = tuple(replace(leg, start=leg.start * nodes, stop=leg.stop * nodes) for leg in path.legs)
    return TorquePath(torque.ravel(), time.ravel(), path.start_torque_nm, legs)


@dataclass(frozen=True)
class Coordinate:
    """One sampled coordinate: a parameter, and the record it belongs to (None: shared)."""

    parameter: Parameter
    record: int | None

    def label(self, records: int) -> str:
        """Name that is unique in the unit."""
        return self.parameter.name if self.record is None else f"{self.parameter.name}[{self.record}]"


class Transform:
    """All coordinates from the standard-normal space to SI units at once, kind by kind of prior."""

    def __init__(self, priors):
        kinds = dict.fromkeys(type(p) for p in priors)
        self.groups = [
            (np.array([i for i, p in enumerate(priors) if type(p) is kind]), _stacked([p for p in priors if type(p) is kind]))
            for kind in kinds
        ]

    def from_normal(self, z):
        """Physical values, shape (…, dimension), of coordinates of that shape."""
        out = np.empty_like(z)
        for columns, prior in self.groups:
            out[..., columns] = prior.from_normal(z[..., columns])
        return out


def _stacked(priors):
    """One prior of the same kind whose numbers are arrays over ``priors``."""
    return type(priors[0])(**{k: np.array([getattr(p, k) for p in priors]) for k in vars(priors[0])})


@dataclass(frozen=True, eq=False)
class Problem:
    """Model, reduced records and the coordinates z in which the prior is N(0, I)."""

    model: ReducerModel
    records: tuple[RecordData, ...]
    misfit: float = 0.0
    coordinates: tuple[Coordinate, ...] = field(init=False)
    transform: Transform = field(init=False)

    def __post_init__(self):
        shared = [Coordinate(p, None) for p in self.model.parameters if not p.per_record]
        own = [Coordinate(p, r) for r in range(len(self.records)) for p in self.model.parameters if p.per_record]
        object.__setattr__(self, "coordinates", tuple(shared + own))
        priors = [c.parameter.scaled_prior(self.model.scale) for c in self.coordinates]
        object.__setattr__(self, "transform", Transform(priors))

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the coordinates in their order."""
        return tuple(c.label(len(self.records)) for c in self.coordinates)

    @property
    def dimension(self) -> int:
        """Number of sampled coordinates."""
        return len(self.coordinates)

    def physical(self, z) -> np.ndarray:
        """Parameters in SI units, shape (…, dimension), of coordinates ``z`` of the same shape."""
        return self.transform.from_normal(np.asarray(z, float))

    def values(self, z, record: int) -> dict[str, np.ndarray]:
        """Parameters of one record by name, each of shape (…, 1), for coordinates (…, dimension)."""
        return self._named(self.physical(z), record)

    def _named(self, physical, record):
        return {
            c.parameter.name: physical[..., i : i + 1]
            for i, c in enumerate(self.coordinates)
            if c.record is None or c.record == record
        }

    def loading_rate_nm_per_s(self, record: int) -> float:
        """Mean loading rate |dτ/dt| of a record [N·m/s]."""
        blocks = self.records[record].blocks
        return float(np.abs(np.diff(blocks.turning_nm)).sum() / (blocks.end_s[-1] - blocks.begin_s[0]))

    def residuals(self, z) -> list[np.ndarray]:
        """Whitened residuals of each record, shape (…, blocks), with the offset projected out."""
        physical, out = self.physical(z), []
        for r, data in enumerate(self.records):
            angle = self.model.angle(self._named(physical, r), data.path)
            np.subtract(data.blocks.angle_rad, angle, out=angle)
            out.append(np.matmul(angle, data.whitener.T))
        return out

    @property
    def dof(self) -> int:
        """Independent residuals left after the offsets."""
        return sum(d.blocks.angle_rad.size - 1 for d in self.records)

    @property
    def noise_dof(self) -> float:
        """Weight of the noise estimate in chi-square degrees of freedom."""
        return float(min(d.noise.scale_dof for d in self.records))

    def log_likelihood(self, z) -> np.ndarray:
        """Log likelihood with offsets and the common noise factor marginalised, shape (…,), up to a constant."""
        residual = np.concatenate(self.residuals(z), axis=-1)
        chi2 = np.einsum("...i,...i->...", residual, residual)
        return -0.5 * (self.noise_dof + self.dof) * np.log1p(np.maximum(chi2 - self.misfit, 0.0) / self.noise_dof)

    def log_posterior(self, z) -> np.ndarray:
        """Log posterior density of z, shape (walkers,), up to a constant; ``z`` has shape (walkers, dimension)."""
        z = np.atleast_2d(z)
        value = np.empty(z.shape[0])
        for a in range(0, z.shape[0], WALKERS_AT_ONCE):
            part = z[a : a + WALKERS_AT_ONCE]
            value[a : a + WALKERS_AT_ONCE] = self.log_likelihood(part)
        value -= 0.5 * np.einsum("wi,wi->w", z, z)
        if np.isnan(value).any():
            raise FloatingPointError("the model returned NaN inside the prior's support")
        return value

    def offsets_rad(self, z) -> np.ndarray:
        """Generalised least-squares encoder offsets given z, shape (…, records) [rad]."""
        out = []
        for r, data in enumerate(self.records):
            raw = data.blocks.angle_rad - self.model.angle(self.values(z, r), data.path)
            out.append(raw @ data.offset_weight)
        return np.stack(out, axis=-1)
