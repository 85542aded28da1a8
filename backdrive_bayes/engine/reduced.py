"""What inference sees of a unit: block means in shares of two scales, their noise, and where the torque has been."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from backdrive_bayes.engine.covariance import channel_covariance, local_slope, path_covariance
from backdrive_bayes.mechanics.effect import Context
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.noise import ChannelRecord, NoiseEstimate, estimate_common_noise
from backdrive_bayes.records.record import Unit
from backdrive_bayes.records.reduction import Blocks, full_legs, loading_rate, reduce_record

MOST_BLOCKS, PER_LEG = 1200, (40, 120)
"""Blocks of all records together beyond which each leg gets fewer, for time grows with their square, and the fewest and the most
of a full leg."""
UNREAD = 0.15
UNREAD_LENGTH = 0.1
"""Torque that acts on the reducer and is not read (ripple, cables), in the torque noise of a sample, and the torque, in shares of
the largest, over which it changes: a flank is crossed with one value of it."""
ZERO = 0.5
"""How far the torque channel's zero of a record is from that of all, in the torque noise of a sample: a bridge warms, a
cable hangs otherwise. Half of the noise is too little to be seen in the torque itself."""
WHITE_SHARE = 0.2
"""Share of the white noise's standard deviation that is left in a block mean, for the scale of traces."""


@dataclass(frozen=True)
class Jitter:
    """Jitter of the crossing torques: clearances do not cross at the same torque twice.

    ``torque`` is its standard deviation and ``length`` the torque over which it is correlated within a leg, in
    shares of the scale.
    """

    torque: float
    length: float


@dataclass(frozen=True, eq=False)
class BlockMeans:
    """Block means of records; angles in shares of ``angle_scale_rad``, torques of ``torque_scale_nm`` (the largest)."""

    blocks: tuple[Blocks, ...]
    noise: tuple[NoiseEstimate, ...]

    @cached_property
    def torque_scale_nm(self) -> float:
        """Largest torque of the unit's records [N·m]."""
        return float(max(np.abs(b.turning_nm).max() for b in self.blocks))

    @cached_property
    def angle_scale_rad(self) -> float:
        """Half the widest angle range of any record [rad]."""
        return float(0.5 * max(np.ptp(b.angle_rad) for b in self.blocks))

    @cached_property
    def angles(self) -> tuple[np.ndarray, ...]:
        """Block means of the angle, (blocks,) for each record."""
        return tuple(b.angle_rad / self.angle_scale_rad for b in self.blocks)

    @cached_property
    def settled(self) -> tuple[np.ndarray, ...]:
        """Which blocks count, (blocks,) for each record: none before the torque has turned where all earlier turning points are
        wiped out (Mayergoyz, 1991, ch. 1). That is at the first tip, beyond which nothing is taken to have been before; a single
        leg is all there is."""
        found = []
        for blocks in self.blocks:
            found.append(blocks.leg >= (0 if blocks.begins_at_tip or blocks.direction.size == 1 else 1))
        return tuple(found)

    @cached_property
    def spans_nm(self) -> tuple[np.ndarray, ...]:
        """Torque that each block spans [N·m], (blocks,) for each record; none where it does not count."""
        return tuple(np.abs(np.diff(b.edges_nm(), axis=0))[0] * own for b, own in zip(self.blocks, self.settled, strict=True))

    @cached_property
    def context(self) -> Context:
        """Rates, durations and noise levels."""
        duration = np.array([b.end_s[-1] - b.begin_s[0] for b in self.blocks])
        angle = [np.hypot(n.correlated_rad, WHITE_SHARE * n.white_rad) for n in self.noise]
        torque = [n.torque_nm for n in self.noise]
        return Context(
            self.torque_scale_nm,
            self.angle_scale_rad,
            np.array([loading_rate(b.path_s, b.path_nm) for b in self.blocks]) / self.torque_scale_nm,
            duration,
            float(np.median(angle)) / self.angle_scale_rad,
            max(float(np.median(torque)) / self.torque_scale_nm, 1e-5),
            np.array([np.abs(b.path_nm).max() for b in self.blocks]) / self.torque_scale_nm,
        )

    @cached_property
    def read_slopes(self) -> list[np.ndarray]:
        """Slopes of the angle as read, over twice the torque noise: before anything is predicted."""
        return self.slopes(self.angles, 2.0)

    @property
    def scale_dof(self) -> float:
        """Weight of the noise estimate in chi-square degrees of freedom."""
        return float(min(n.scale_dof for n in self.noise))

    def slopes(self, angles, least: float = 1.0) -> list[np.ndarray]:
        """|dθ/dτ| of angles (blocks,) at the blocks [rad/(N·m)], over no less than ``least`` times the torque noise."""
        scaled = (np.asarray(a) * self.angle_scale_rad for a in angles)
        return [local_slope(b, a, least * n.torque_nm) for b, a, n in zip(self.blocks, scaled, self.noise, strict=True)]

    @cached_property
    def _still(self) -> list[tuple]:
        """What no slope changes: the angle channel's covariance, distances of torques within legs, and the torque not read with
        the record's zero."""
        found = []
        for blocks, noise in zip(self.blocks, self.noise, strict=True):
            apart = np.abs(blocks.torque_nm[:, None] - blocks.torque_nm) / self.torque_scale_nm
            apart[blocks.leg[:, None] != blocks.leg] = np.inf
            unread = noise.torque_nm**2 * (UNREAD**2 * np.exp(-apart / UNREAD_LENGTH) + ZERO**2)
            found.append((channel_covariance(blocks, noise), apart, unread))
        return found

    def covariances(self, slopes, jitter: Jitter) -> list[np.ndarray]:
        """Covariance of each record's block means in squared shares of the angle scale."""
        found = []
        for blocks, slope, (channel, apart, unread) in zip(self.blocks, slopes, self._still, strict=True):
            wander = unread + (jitter.torque * self.torque_scale_nm) ** 2 * np.exp(-apart / jitter.length)
            matrix = channel + path_covariance(blocks, slope) + np.outer(slope, slope) * wander
            found.append(matrix / self.angle_scale_rad**2)
        return found


@dataclass(frozen=True, eq=False)
class Reduced(BlockMeans):
    """A unit reduced to block means, with the ``unit`` itself."""

    unit: Unit

    def without(self, record: int) -> Reduced:
        """The unit less one record."""
        return replace(
            self, blocks=self.blocks[:record] + self.blocks[record + 1 :], noise=self.noise[:record] + self.noise[record + 1 :]
        )


def reduce_unit(unit: Unit, blocks_per_leg: int | None = None) -> Reduced:
    """Block means of every record with the noise that all share."""
    segments = [find_segments(r.time_s, r.torque_nm) for r in unit.records]
    noise = estimate_common_noise(
        [ChannelRecord(r.time_s, r.torque_nm, r.angle_rad, s) for r, s in zip(unit.records, segments, strict=True)]
    )
    count = blocks_per_leg or int(np.clip(MOST_BLOCKS / sum(map(full_legs, unit.records, segments)), *PER_LEG))
    blocks = tuple(reduce_record(r, s, n, count) for r, s, n in zip(unit.records, segments, noise, strict=True))
    return Reduced(blocks, noise, unit)
