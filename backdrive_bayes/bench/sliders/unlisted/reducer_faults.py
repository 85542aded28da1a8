"""Unlisted effects inside the reducer: teeth, wear, temperature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class ToothDefect(Effect):
    """A bump of the transmission error at one output angle; ``place``, ``width`` and strength are angle shares."""

    place: float
    width: float
    direction: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Bump [rad]."""
        off = (angle_rad / run.reducer.angle_rad - self.place) / self.width
        return self.direction * self.strength * run.reducer.angle_rad * np.exp(-0.5 * off**2)


@dataclass(frozen=True)
class MissingTooth(Effect):
    """The mesh is softer within a window of output angle, edges of a tooth's ``edge``; strength is angle share at T_r."""

    place: float
    width: float
    edge: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Extra deflection in the window [rad]."""
        off = np.abs(angle_rad / run.reducer.angle_rad - self.place) - self.width
        inside = 0.5 - 0.5 * np.tanh(off / self.edge)
        return self.strength * run.reducer.angle_rad * inside * transmitted_nm / run.reducer.rated_torque_nm


@dataclass(frozen=True)
class LoadedRunout(Effect):
    """Stage run-out that grows with the load, periodic in output angle; ``period`` and strength are angle shares."""

    period: float
    phase: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Periodic error [rad]."""
        turn = 2 * np.pi * angle_rad / (self.period * run.reducer.angle_rad) + self.phase
        return self.strength * run.reducer.angle_rad * np.abs(transmitted_nm / run.reducer.rated_torque_nm) * np.sin(turn)


@dataclass(frozen=True)
class TemperatureStiffness(Effect):
    """Compliance changes about its middle as the unit warms with ``scale_s`` since switch-on; strength is angle share at T_r."""

    scale_s: float
    direction: float

    most = 3.0

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Extra deflection [rad]."""
        warm = 0.5 - np.exp(-np.maximum(run.bench_time_s, 0.0) / self.scale_s)
        load = transmitted_nm / run.reducer.rated_torque_nm
        return self.direction * self.strength * run.reducer.angle_rad * warm * load


@dataclass(frozen=True)
class Wear(Effect):
    """The clearance grows with the torque travelled, and from record to record; strength is angle share."""

    per_record: float

    most = 3.0

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Angle of the worn clearance [rad]."""
        travelled = np.r_[0.0, np.cumsum(np.abs(np.diff(run.load)))] / 5.0
        side = np.tanh(transmitted_nm / (0.03 * run.reducer.rated_torque_nm))
        return self.strength * run.reducer.angle_rad * (self.per_record * run.index + travelled) * side


@dataclass(frozen=True)
class AmplitudeBacklash(Effect):
    """Bearings give: the clearance opens with the largest torque of the last half-cycle; strength is angle share at T_r."""

    power: float

    most = 3.0

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Angle of the opened clearance [rad], only while the torque falls from that largest value."""
        load = transmitted_nm / run.reducer.rated_torque_nm
        largest, out, side = 0.0, np.empty_like(load), 1.0
        for k, value in enumerate(load.tolist()):
            if value * side < 0:
                largest, side = 0.0, -side
            largest = max(largest, abs(value))
            out[k] = side * largest**self.power * (1.0 - abs(value) / largest if largest else 0.0) * abs(value)
        return self.strength * run.reducer.angle_rad * out


def draw_tooth(rng, reducer):
    """Anywhere in the measured range, a twentieth to an eighth wide."""
    return ToothDefect(0.0, rng.uniform(-0.7, 0.7), rng.uniform(0.04, 0.12), sign(rng))


def draw_missing(rng, reducer):
    """On a loaded flank."""
    place = sign(rng) * rng.uniform(0.45, 0.75)
    return MissingTooth(0.0, place, rng.uniform(0.08, 0.2), rng.uniform(0.01, 0.04))


def draw_runout(rng, reducer):
    """Two to eight periods in the range."""
    return LoadedRunout(0.0, log_uniform(rng, 0.25, 1.0), rng.uniform(0, 2 * np.pi))


def draw_temperature(rng, reducer):
    """One to five minutes."""
    return TemperatureStiffness(0.0, log_uniform(rng, 60.0, 300.0), sign(rng))


def draw_wear(rng, reducer):
    """With more or less left between records."""
    return Wear(0.0, rng.uniform(0.2, 1.0))


def draw_amplitude(rng, reducer):
    """Proportional to the amplitude or its square."""
    return AmplitudeBacklash(0.0, rng.uniform(1.0, 2.0))
