"""Unlisted effects between the torque that is read and the torque that acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.patches import joint_turn
from backdrive_bayes.bench.draws import log_uniform, sign


@dataclass(frozen=True)
class TorqueGainWave(ContactEffect):
    """The sensor's characteristic waves, ``waves`` half-waves up to T_r; strength is share of T_r."""

    waves: float

    most = 0.1
    of_reducer = False

    def load(self, test, time_s, load):
        """Acting torque."""
        return load + self.strength * np.sin(np.pi * self.waves * np.abs(load)) * np.tanh(load / 0.05)


@dataclass(frozen=True)
class TorqueSensorHysteresis(ContactEffect):
    """The sensor's bonded gauge slides: ``limits`` of its patches are shares of T_r, strength is the share of T_r it holds."""

    limits: tuple[float, ...]
    direction: float

    most = 0.2
    of_reducer = False

    def load(self, test, time_s, load):
        """Acting torque."""
        limit = np.array(self.limits) / len(self.limits)
        behind = load - joint_turn(load, np.full(limit.size, 0.5 / limit.size), 0.5 * limit, 0.5)
        return load + self.direction * self.strength * behind / np.mean(self.limits)


@dataclass(frozen=True)
class UnseenRipple(ContactEffect):
    """A ripple of the acting torque in time that the sensor's filter hides; strength is share of T_r."""

    frequency_hz: float
    phase: float

    most = 0.2
    of_reducer = False

    def times_s(self, test):
        """Sixteen a period."""
        if not self.strength:
            return np.zeros(0)
        path = test.where.path
        return np.arange(path.time_s[0], path.end_s, 1.0 / (16.0 * self.frequency_hz))

    def load(self, test, time_s, load):
        """Acting torque."""
        turn = 2 * np.pi * self.frequency_hz * (test.where.start_s + time_s) + self.phase
        return load + self.strength * np.sin(turn)


def draw_gain(rng, reducer):
    """Two to five half-waves."""
    return TorqueGainWave(0.0, rng.uniform(2.0, 5.0))


def draw_hysteresis(rng, reducer):
    """Patches that slide from a twentieth to half of the rated torque."""
    return TorqueSensorHysteresis(0.0, tuple(rng.uniform(0.05, 0.5, 4).tolist()), sign(rng))


def draw_ripple(rng, reducer):
    """0.2 to 3 Hz."""
    return UnseenRipple(0.0, log_uniform(rng, 0.2, 3.0), rng.uniform(0.0, 2 * np.pi))
