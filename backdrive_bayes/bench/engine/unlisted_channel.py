"""Unlisted effects of the measuring channel."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.engine.effect import EngineEffect


@dataclass(frozen=True)
class MainsHum(EngineEffect):
    """A hum of ``frequency_hz`` on the reading, beating slowly; ``strength`` is its amplitude over the angle scale."""

    frequency_hz: float = 50.0
    beat_hz: float = 0.05
    phase: float = 0.0

    most = 0.3
    of_reducer = False

    def read(self, run, time_s, angle_rad):
        """The humming reading."""
        at = 2.0 * np.pi * (run.where.start_s + time_s)
        hum = np.sin(self.frequency_hz * at + self.phase) * (1.0 + 0.5 * np.sin(self.beat_hz * at))
        return angle_rad + self.strength * run.reducer.angle_rad * hum


def draw_mains_hum(rng, reducer):
    """European or American mains, or a slow pump."""
    frequency = float(rng.choice([50.0, 60.0, rng.uniform(0.5, 5.0)]))
    return MainsHum(frequency_hz=frequency, beat_hz=log_uniform(rng, 0.01, 0.2), phase=float(rng.uniform(0.0, 2.0 * np.pi)))


@dataclass(frozen=True)
class MountJump(EngineEffect):
    """The encoder's mount gives way by ``strength`` over the angle scale, in every record or in one ``record``.

    It does so within ``duration`` at ``at``, both shares of the record.
    """

    at: float = 0.5
    duration: float = 0.002
    record: int = -1
    sign: float = 1.0

    most = 0.5
    of_reducer = False

    def read(self, run, time_s, angle_rad):
        """The reading with its step."""
        if self.record not in (-1, run.where.index):
            return angle_rad
        share = (time_s / run.where.path.end_s - self.at) / self.duration
        return angle_rad + self.sign * self.strength * run.reducer.angle_rad * 0.5 * (1.0 + np.tanh(share))


def draw_mount_jump(rng, reducer):
    """In the first record or in all."""
    return MountJump(at=float(rng.uniform(0.25, 0.9)), record=int(rng.choice([-1, 0])), sign=sign(rng))


@dataclass(frozen=True)
class AngleScale(EngineEffect):
    """The encoder's scale differs from record to record, by about ``strength``: ``pattern`` gives each record's share."""

    pattern: tuple[float, ...] = (0.0, 1.0, -1.0)

    most = 0.3
    of_reducer = False

    def read(self, run, time_s, angle_rad):
        """The reading in this record's scale."""
        return angle_rad * (1.0 + self.strength * self.pattern[run.where.index % len(self.pattern)])


def draw_angle_scale(rng, reducer):
    """Scales of eight records."""
    return AngleScale(pattern=tuple(rng.uniform(-1.0, 1.0, 8).round(3).tolist()))


@dataclass(frozen=True)
class SensorHysteresis(EngineEffect):
    """The torque sensor's own hysteresis: the acting torque differs from the one read by up to ``strength`` over T_r.

    It fades over a ``memory`` of torque over T_r.
    """

    memory: float = 0.5

    guess = 0.005
    most = 0.15
    of_reducer = False

    def load(self, run, load):
        """Torque that acts when the sensor reads ``load``; a viscous element in torque instead of time."""
        return load + self.strength * _trailing(load, self.memory)


@numba.njit(cache=True)
def _trailing(load, memory):
    """Difference to a state that follows the load exponentially along its path, over the memory."""
    trail, found = load[0], np.empty_like(load)
    for i in range(load.size):
        gone = abs(load[i] - load[i - 1]) if i else 0.0
        trail += (load[i] - trail) * (1.0 - np.exp(-gone / memory))
        found[i] = (load[i] - trail) / memory
    return found


def draw_sensor_hysteresis(rng, reducer):
    """A memory."""
    return SensorHysteresis(memory=log_uniform(rng, 0.15, 1.0))


@dataclass(frozen=True)
class SensorGain(EngineEffect):
    """The torque sensor is not linear: the acting torque differs by ``strength`` over T_r times a wave of the torque read."""

    waves: float = 1.5
    phase: float = 0.0

    guess = 0.005
    most = 0.1
    of_reducer = False

    def load(self, run, load):
        """The acting torque; zero at zero load."""
        return load + self.strength * (np.sin(np.pi * self.waves * load + self.phase) - np.sin(self.phase))


def draw_sensor_gain(rng, reducer):
    """One to three waves over the range."""
    return SensorGain(waves=float(rng.uniform(1.0, 3.0)), phase=float(rng.uniform(0.0, 2.0 * np.pi)))
