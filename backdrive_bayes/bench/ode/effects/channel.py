"""Effects of the measuring channel: lag, drift, torque offset, and the encoder's interpolation error."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.ode.effect import OdeEffect

BEND = 1e-6
"""Departure of the lagging angle from straight lines between its points, in angle scales."""


@dataclass(frozen=True)
class SensorLag(OdeEffect):
    """The angle is late by a delay, or behind one or two poles; strength is the whole lag [s], ``share`` the first of two's."""

    variant: str = "delay"
    share: float = 0.7

    guess = 0.02
    most = 0.5
    of_reducer = False

    def respond(self, run, time_s, angle):
        """Late angle."""
        if self.variant == "delay":
            return time_s + self.strength, angle
        if self.variant == "one pole":
            return _pole(time_s, angle, self.strength)
        return _pole(*_pole(time_s, angle, self.share * self.strength), (1.0 - self.share) * self.strength)


@numba.njit(cache=True)
def _pole(time_s, signal, constant_s):
    """Times and first-order answer to a signal that is straight between its points, from rest, with steps where it bends."""
    times, out = [time_s[0]], [signal[0]]
    for k in range(1, time_s.size):
        whole = time_s[k] - time_s[k - 1]
        slope = (signal[k] - signal[k - 1]) / whole
        begin, settled = out[-1], signal[k - 1] - slope * constant_s
        bent = min(whole, 12.0 * constant_s)
        pieces = int(np.ceil(bent / constant_s * np.sqrt(abs(begin - settled) / (8.0 * BEND))))
        for j in range(1, pieces):
            late = bent * (j / pieces) ** 1.5
            times.append(time_s[k - 1] + late)
            out.append(settled + slope * late + (begin - settled) * np.exp(-late / constant_s))
        times.append(time_s[k])
        out.append(settled + slope * whole + (begin - settled) * np.exp(-whole / constant_s))
    return np.array(times), np.array(out)


@dataclass(frozen=True)
class ThermalDrift(OdeEffect):
    """Drift of the reading with the bench's time; strength is its size in angle scales in ``scale_s`` seconds.

    A warming column of two bodies (the second four times slower), a straight line, or a slow wave.
    """

    variant: str = "line"
    direction: float = 1.0
    scale_s: float = 60.0
    phase: float = 0.0

    most = 10.0
    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle with drift."""
        return angle + self.strength * self.direction * self._course(run.bench_time_s(time_s) / self.scale_s)

    def _course(self, time):
        if self.variant == "warming":
            late = np.maximum(time, 0.0)
            return 1.0 - (4.0 * np.exp(-late / 4.0) - np.exp(-late)) / 3.0
        return np.sin(2.0 * np.pi * time + self.phase) if self.variant == "wave" else time


@dataclass(frozen=True)
class TorqueOffset(OdeEffect):
    """The acting torque is more than what is read, in one direction; strength is the difference over T_r."""

    direction: float = 1.0

    most = 0.15
    of_reducer = False

    def torque(self, run, time_s, torque):
        """Acting torque."""
        return torque + self.direction * self.strength


@dataclass(frozen=True)
class EncoderError(OdeEffect):
    """Error with ``period`` (angle scales): of two signals with unequal gain and an offset, a triangle, or two harmonics.

    Strength is near the steepest slope of the error. Source of the first: Heydemann, Appl. Opt. 20, 1981.
    """

    variant: str = "signals"
    period: float = 0.1
    phase: float = 0.0
    mix: float = 0.3

    guess = 0.2
    most = 0.8
    of_reducer = False

    def read(self, run, time_s, angle):
        """Angle with interpolation error."""
        turn = 2.0 * np.pi * angle / self.period + self.phase
        return angle + self.period / (2.0 * np.pi) * self._error(turn)

    def _error(self, turn):
        size = self.strength
        if self.variant == "signals":
            sine, cosine = np.sin(turn) * (1.0 + self.mix * size), np.cos(turn) + (1.0 - self.mix) * size
            return np.angle((cosine + 1j * sine) * np.exp(-1j * turn))
        if self.variant == "triangle":
            return size * np.arcsin(0.98 * np.sin(turn))
        return size * (np.sin(turn) + self.mix * np.sin(2.0 * turn + 0.7)) / (1.0 + self.mix)


def draw_lag(rng, reducer):
    """A delay, one pole, or two."""
    variant = str(rng.choice(["delay", "one pole", "two poles"]))
    return SensorLag(0.0, variant, rng.uniform(0.5, 0.85))


def draw_drift(rng, reducer):
    """Warming in 20 s to 5 min, a line, or a wave of 40 s to 5 min."""
    variant = str(rng.choice(["warming", "line", "wave"]))
    return ThermalDrift(
        0.0, variant, sign(rng), log_uniform(rng, 40.0 if variant == "wave" else 20.0, 300.0), rng.uniform(0, 6.28)
    )


def draw_offset(rng, reducer):
    """Either way."""
    return TorqueOffset(0.0, sign(rng))


def draw_encoder(rng, reducer):
    """Three to forty periods in the measured range."""
    variant = str(rng.choice(["signals", "triangle", "harmonics"]))
    return EncoderError(0.0, variant, log_uniform(rng, 0.05, 0.6), rng.uniform(0, 6.28), rng.uniform(0.0, 0.6))
