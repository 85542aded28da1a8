"""Effects of the measuring channel: lag, drift, torque offset, and the encoder's interpolation error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.relaxation import relaxed_at
from backdrive_bayes.bench.draws import log_uniform, sign


@dataclass(frozen=True)
class SensorLag(ContactEffect):
    """Reading behind the angle by strength, in seconds, on a steady slope; ``damping`` is that of the two-pole filter."""

    law: str
    damping: float

    of_reducer = False

    def late(self, test, run, time_s):
        """Lagging reading less the angle."""
        plain = np.interp(time_s, run.time_s, run.angle)
        if self.strength <= 0.0:
            return np.zeros_like(plain)
        if self.law == "delay":
            return np.interp(time_s - self.strength, run.time_s, run.angle) - plain
        if self.law == "one_pole":
            return relaxed_at(run.time_s, run.angle, self.strength, time_s).real - plain
        return self._two_poles(run, time_s) - plain

    def _two_poles(self, run, time_s):
        # Conjugate poles as one complex relaxation: y = Re(c z) with c such that the steady gain is 1 and the start is flat.
        root = self.damping + 1j * np.sqrt(1.0 - self.damping**2)
        pole = self.strength / (2.0 * self.damping * root)
        share = 1.0 + 1j * root.real / root.imag
        return (share * relaxed_at(run.time_s, run.angle, pole, time_s)).real


def draw_sensor_lag(rng, reducer):
    """Three laws."""
    return SensorLag(0.0, str(rng.choice(["delay", "one_pole", "two_poles"])), rng.uniform(0.4, 0.9))


@dataclass(frozen=True)
class ThermalDrift(ContactEffect):
    """Drift over the bench's time: ``law`` 'housing' warms behind its motor (two time constants, ``scale_s`` the slow one),
    'linear' goes on at one rate, 'room' follows a triangular wave of period ``scale_s``; strength is angle share, signed by
    ``direction``."""

    law: str
    direction: float
    scale_s: float
    ratio: float
    phase: float

    guess = 0.03
    most = 3.0
    of_reducer = False

    def read(self, test, time_s, angle):
        """Drifting reading."""
        t = (test.where.start_s + time_s) / self.scale_s
        if self.law == "linear":
            drift = t
        elif self.law == "room":
            drift = np.arcsin(0.97 * np.sin(2 * np.pi * t + self.phase)) / np.pi
        else:
            drift = 1.0 - (np.exp(-t) - self.ratio * np.exp(-t / self.ratio)) / (1.0 - self.ratio)
        return angle + self.direction * self.strength * drift


def draw_thermal_drift(rng, reducer):
    """One to ten minutes, three laws."""
    law = str(rng.choice(["housing", "linear", "room"]))
    return ThermalDrift(0.0, law, sign(rng), log_uniform(rng, 50.0, 500.0), rng.uniform(0.05, 0.3), rng.uniform(0.0, 2 * np.pi))


@dataclass(frozen=True)
class TorqueOffset(ContactEffect):
    """Acting torque beside the commanded one, strength in shares of T_r; ``retared`` scatters it from record to record."""

    direction: float
    retared: tuple[float, ...]

    most = 0.3
    of_reducer = False

    def load(self, test, time_s, load):
        """Offset torque."""
        return load + self.direction * self.strength * (1.0 + self.retared[test.where.index % len(self.retared)])


def draw_torque_offset(rng, reducer):
    """Either sign; the same in all records, or zeroed anew before each."""
    scatter = 0.3 * float(rng.integers(2))
    return TorqueOffset(0.0, sign(rng), tuple((scatter * rng.uniform(-1, 1, 8)).tolist()))


@dataclass(frozen=True)
class EncoderError(ContactEffect):
    """Angle read from distorted quadrature signals; ``period`` is one signal period, an angle share, ``phase`` where it starts.

    Strength is the distortion of the signals over their amplitude, shared out as ``offset`` of the sine, ``gain`` of the cosine
    and ``shape``, the third harmonic (flattened signals). Source: Heydemann, Appl. Opt. 20, 1981.
    """

    period: float
    phase: float
    offset: float
    gain: float
    shape: float

    guess = 0.1
    most = 0.85
    of_reducer = False

    def read(self, test, time_s, angle):
        """Angle with interpolation error."""
        turn = 2 * np.pi * angle / self.period + self.phase
        sine = np.sin(turn) + self.strength * (self.offset - self.shape * np.sin(3 * turn) / 3.0)
        cosine = (1.0 + self.strength * self.gain) * np.cos(turn) + self.strength * self.shape * np.cos(3 * turn) / 3.0
        wrong = np.angle((cosine + 1j * sine) * np.exp(-1j * turn))
        return angle + self.period * wrong / (2 * np.pi)


def draw_encoder_error(rng, reducer):
    """Three to forty periods in the measured range; mostly offset, gain, or shape."""
    parts = [(1.0, 0.0, 0.0), (0.4, 1.5, 0.0), (0.1, 0.2, 1.0), (0.7, 0.5, 0.5)][int(rng.integers(4))]
    return EncoderError(0.0, log_uniform(rng, 0.05, 0.6), rng.uniform(0.0, 2 * np.pi), *parts)
