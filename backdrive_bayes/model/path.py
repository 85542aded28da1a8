"""A torque history as the reducer sees it: monotone legs between turning points."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Leg:
    """One monotone stretch: samples [start, stop), direction +1 or -1, torque at its far end [N·m]."""

    start: int
    stop: int
    direction: int
    end_torque_nm: float


@dataclass(frozen=True, eq=False)
class TorquePath:
    """A torque history: ``torque_nm`` and ``time_s`` of shape (samples,), the torque it starts from, and its legs.

    The legs are contiguous, cover all samples and alternate in direction; inside a leg the samples lie between the
    turning torques at its two ends. Turning points need not be samples. Where samples are means over blocks, ``within`` is the
    same path at an odd number of nodes within each block, the middle one being the sample.
    """

    torque_nm: np.ndarray
    time_s: np.ndarray
    start_torque_nm: float
    legs: tuple[Leg, ...]
    within: TorquePath | None = None

    @functools.cached_property
    def direction(self) -> np.ndarray:
        """Direction of the torque at each sample, ±1.0, shape (samples,)."""
        return np.concatenate([np.full(leg.stop - leg.start, float(leg.direction)) for leg in self.legs])

    @functools.cached_property
    def leg_table(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Last sample + 1, direction ±1.0 and end torque [N·m] of the legs, shape (legs,) each."""
        legs = self.legs
        return (
            np.array([leg.stop for leg in legs]), np.array([float(leg.direction) for leg in legs]),
            np.array([leg.end_torque_nm for leg in legs]),
        )  # fmt: skip

    @functools.cached_property
    def rate_nm_per_s(self) -> np.ndarray:
        """Mean loading rate |dτ/dt| of the leg at each sample [N·m/s], shape (samples,)."""
        rates, last = [], self.start_torque_nm
        for leg in self.legs:
            time, torque = self.time_s[leg.start : leg.stop], self.torque_nm[leg.start : leg.stop]
            took, way = (np.ptp(time), np.ptp(torque)) if np.ptp(torque) > 0 else (1.0, abs(leg.end_torque_nm - last))
            rates.append(np.full(time.size, way / took if took > 0 else 0.0))
            last = leg.end_torque_nm
        return np.concatenate(rates)

    @classmethod
    def from_samples(cls, torque_nm, time_s=None) -> TorquePath:
        """A path through noise-free torque samples of shape (samples,), turning at their local extremes."""
        torque = np.asarray(torque_nm, float)
        time = np.arange(torque.size, dtype=float) if time_s is None else np.asarray(time_s, float)
        step = np.sign(np.diff(torque))
        moving = np.flatnonzero(step)
        if moving.size == 0:
            return cls(torque, time, float(torque[0]), (Leg(0, torque.size, 1, float(torque[-1])),))
        flips = np.flatnonzero(np.diff(step[moving])) + 1
        turns = moving[flips]
        bounds = np.r_[0, turns + 1, torque.size]
        signs = step[moving[np.r_[0, flips]]]
        ends = np.r_[torque[turns], torque[-1]]
        legs = tuple(
            Leg(int(a), int(b), int(s), float(e))
            for a, b, s, e in zip(bounds[:-1], bounds[1:], signs, ends, strict=True)
        )
        return cls(torque, time, float(torque[0]), legs)

    @classmethod
    def from_turning_points(cls, turning_nm, points_per_leg: int = 200, rate_nm_per_s: float = 1.0) -> TorquePath:
        """A noise-free path through the given turning torques, ``points_per_leg`` evenly spaced samples a leg."""
        turning = np.asarray(turning_nm, float)
        torque = [turning[:1]]
        for a, b in zip(turning[:-1], turning[1:], strict=True):
            torque.append(np.linspace(a, b, points_per_leg + 1)[1:])
        torque = np.concatenate(torque)
        time = np.r_[0.0, np.cumsum(np.abs(np.diff(torque)))] / rate_nm_per_s
        return cls.from_samples(torque, time)
