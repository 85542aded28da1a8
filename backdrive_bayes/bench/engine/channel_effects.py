"""Effects of the measuring channel: the engine's angle as a late, drifting, imperfect encoder reads it."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.engine.effect import EngineEffect


@dataclass(frozen=True)
class SensorLag(EngineEffect):
    """The angle is late by ``strength`` seconds: a pure delay, or one or two first-order lags after another (``kind``)."""

    kind: str = "delay"

    guess = 0.005
    most = 0.3
    of_reducer = False

    def transmit(self, run, angle_rad):
        """The late angle."""
        time = run.steps.time_s
        if not self.strength:
            return angle_rad
        if self.kind == "delay":
            return np.interp(time - self.strength, time, angle_rad)
        poles = 2 if self.kind == "two_pole" else 1
        for _ in range(poles):
            angle_rad = _first_order(time, angle_rad, self.strength / poles)
        return angle_rad


@numba.njit(cache=True)
def _first_order(time, value, lag):
    """Exact answer of a first-order lag to a piecewise linear input."""
    late = np.empty_like(value)
    late[0] = value[0]
    for i in range(1, value.size):
        step = time[i] - time[i - 1]
        if step <= 0.0:
            late[i] = late[i - 1]
            continue
        slope, fade = (value[i] - value[i - 1]) / step, np.exp(-step / lag)
        late[i] = value[i] - slope * lag * (1.0 - fade) + (late[i - 1] - value[i - 1]) * fade
    return late


def draw_sensor_lag(rng, reducer):
    """One of three kinds."""
    return SensorLag(kind=str(rng.choice(["delay", "first_order", "two_pole"])))


@dataclass(frozen=True)
class ThermalDrift(EngineEffect):
    """The reading drifts with the bench's time: ``kind`` warm_up (two bodies), linear or wave; ``period_s`` its time.

    ``strength`` is the drift over one ``period_s`` over the angle scale.
    """

    kind: str = "linear"
    period_s: float = 60.0
    phase: float = 0.0
    sign: float = 1.0

    most = 2.0
    of_reducer = False

    def read(self, run, time_s, angle_rad):
        """The drifted reading."""
        at = (run.where.start_s + time_s) / self.period_s
        if self.kind == "warm_up":
            course = 1.0 - 0.7 * np.exp(-at) - 0.3 * np.exp(-4.0 * at)
        elif self.kind == "linear":
            course = at
        else:
            course = 0.5 * np.sin(2.0 * np.pi * at + self.phase)
        return angle_rad + self.sign * self.strength * run.reducer.angle_rad * course


def draw_thermal_drift(rng, reducer):
    """A course, a time and a sign."""
    kind = str(rng.choice(["warm_up", "linear", "wave"]))
    period = log_uniform(rng, 40.0, 200.0) if kind == "wave" else log_uniform(rng, 30.0, 300.0)
    return ThermalDrift(kind=kind, period_s=period, phase=float(rng.uniform(0, 2 * np.pi)), sign=sign(rng))


@dataclass(frozen=True)
class TorqueOffset(EngineEffect):
    """The acting torque differs from the one read by ``strength`` over T_r: a sensor's zero, or a dead weight at ``tilt_rad``."""

    sign: float = 1.0
    tilt_rad: float | None = None

    guess = 0.005
    most = 0.15
    of_reducer = False

    def load(self, run, load):
        """Torque with the offset; a weight's lever turns with the output, here as far as the load alone would take it."""
        if self.tilt_rad is None:
            return load + self.sign * self.strength
        turned = run.reducer.angle_rad * np.tanh(load)
        return load + self.sign * self.strength * np.cos(self.tilt_rad + turned)


def draw_torque_offset(rng, reducer):
    """A sensor's zero error or a weight on a lever."""
    tilt = float(rng.uniform(-0.8, 0.8)) if rng.uniform() < 0.4 else None
    return TorqueOffset(sign=sign(rng), tilt_rad=tilt)


@dataclass(frozen=True)
class EncoderError(EngineEffect):
    """Interpolation error, periodic in the angle: ``strength`` its amplitude, ``period`` its period, both over the angle scale.

    ``second`` is the share of the second harmonic; ``triangular`` makes it a zigzag.
    """

    period: float = 0.3
    phase: float = 0.0
    second: float = 0.0
    triangular: bool = False

    most = 0.3
    of_reducer = False

    def read(self, run, time_s, angle_rad):
        """The wavy reading."""
        at = 2.0 * np.pi * angle_rad / (self.period * run.reducer.angle_rad) + self.phase
        wave = 2.0 / np.pi * np.arcsin(np.sin(at)) if self.triangular else np.sin(at) + self.second * np.sin(2.0 * at + 1.0)
        return angle_rad + self.strength * run.reducer.angle_rad * wave


def draw_encoder_error(rng, reducer):
    """A period, and a shape: sine, two harmonics, or zigzag."""
    shape = str(rng.choice(["sine", "harmonics", "zigzag"]))
    second = float(rng.uniform(0.2, 0.7)) if shape == "harmonics" else 0.0
    period, phase = log_uniform(rng, 0.1, 0.7), float(rng.uniform(0.0, 2.0 * np.pi))
    return EncoderError(period=period, phase=phase, second=second, triangular=shape == "zigzag")
