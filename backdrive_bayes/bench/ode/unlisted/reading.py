"""Unlisted effects of the mount and the angle reading."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.ode.effect import OdeEffect


@dataclass(frozen=True)
class MainsHum(OdeEffect):
    """Hum of ``frequency_hz`` that beats with another close by; strength is its amplitude in angle scales."""

    frequency_hz: float = 50.0
    beat_hz: float = 0.0
    phase: float = 0.0

    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle with hum."""
        time = run.bench_time_s(time_s)
        beat = np.cos(np.pi * self.beat_hz * time)
        return angle + self.strength * beat * np.sin(2.0 * np.pi * self.frequency_hz * time + self.phase)


@dataclass(frozen=True)
class MountJump(OdeEffect):
    """The mount settles at the share ``moment`` of each record and slowly gives on; strength is the jump in angle scales."""

    moment: float = 0.5
    direction: float = 1.0
    settling: float = 0.3

    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle with the jump."""
        late = np.maximum(time_s - self.moment * run.where.path.end_s, 0.0)
        jump = (late > 0) * (1.0 + self.settling * -np.expm1(-late / (0.1 * run.where.path.end_s)))
        return angle + self.direction * self.strength * jump


@dataclass(frozen=True)
class AngleScale(OdeEffect):
    """The reading's scale changes from record to record; strength is the share between two of them."""

    turns: tuple[float, ...] = (0.0, 1.0, -0.5, 0.6, -1.0)

    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle on another scale."""
        return angle * (1.0 + self.strength * self.turns[run.where.index % len(self.turns)])


@dataclass(frozen=True)
class MountRinging(OdeEffect):
    """A springy mount with the motor's mass rings when the torque's rate changes; strength is its travel at T_r.

    Exact answer of x'' + 2 damping ω x' + ω² x = ω² τ less its quasi-static part, from rest before each turning point.
    """

    frequency_hz: float = 5.0
    damping: float = 0.03

    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle with ringing."""
        path, omega = run.where.path, 2.0 * np.pi * self.frequency_hz
        rate = np.diff(path.torque_nm) / np.diff(path.time_s) / run.reducer.rated_torque_nm
        free, ring = omega * np.sqrt(1.0 - self.damping**2), np.zeros_like(time_s)
        for turn, change in zip(path.time_s[:-1], np.diff(rate, prepend=0.0), strict=True):
            late = np.maximum(time_s - turn, 0.0)
            ring -= change * np.exp(-self.damping * omega * late) * np.sin(free * late) / free
        return angle + self.strength * ring


def draw_hum(rng, reducer):
    """50 or 60 Hz with a beat, or a fan of 12 to 35 Hz."""
    frequency = float(rng.choice([50.0, 60.0, rng.uniform(12.0, 35.0)]))
    return MainsHum(0.0, frequency, rng.uniform(0.0, 0.3), rng.uniform(0, 6.28))


def draw_jump(rng, reducer):
    """In the settled part of the record."""
    return MountJump(0.0, rng.uniform(0.25, 0.9), sign(rng), rng.uniform(0.0, 0.5))


def draw_scale(rng, reducer):
    """Any scales after the first."""
    return AngleScale(0.0, (0.0, sign(rng), *rng.uniform(-1, 1, 5).tolist()))


def draw_ringing(rng, reducer):
    """1 to 10 Hz, lightly damped."""
    return MountRinging(0.0, log_uniform(rng, 1.0, 10.0), log_uniform(rng, 0.004, 0.05))
