"""Unlisted effects between the torque that is measured and the torque that acts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class TorqueSensorHysteresis(Effect):
    """The sensor's own hysteresis: three sliders of ``widths`` (shares of T_r), fading under load; strength is share of T_r."""

    widths: tuple[float, ...]
    direction: float

    most = 0.2
    of_reducer = False

    def torque(self, run, torque_nm):
        """Acting torque [N·m]."""
        rated = run.reducer.rated_torque_nm
        held = elements.sliders(torque_nm, np.full((torque_nm.size, 3), rated) * np.array(self.widths)).mean(axis=1)
        middle = np.maximum(1.0 - (torque_nm / rated) ** 2, 0.0)
        return torque_nm + self.direction * self.strength * (torque_nm - held) / np.mean(self.widths) * middle


@dataclass(frozen=True)
class TorqueGainNonlinearity(Effect):
    """The sensor's gain waves over its range, odd in torque with ``waves`` half-waves up to T_r; strength is share of T_r."""

    waves: float

    most = 0.1
    of_reducer = False

    def torque(self, run, torque_nm):
        """Acting torque [N·m]."""
        return torque_nm + self.strength * run.reducer.rated_torque_nm * np.sin(np.pi * self.waves * run.load)


@dataclass(frozen=True)
class UnseenTorqueRipple(Effect):
    """A ripple in time of the acting torque that the sensor's filter hides; strength is share of T_r."""

    frequency_hz: float
    phase: float

    of_reducer = False

    def torque(self, run, torque_nm):
        """Acting torque [N·m]."""
        ripple = np.sin(2 * np.pi * self.frequency_hz * run.bench_time_s + self.phase)
        return torque_nm + self.strength * run.reducer.rated_torque_nm * ripple


def draw_hysteresis(rng, reducer):
    """Bands of a twentieth to a half of the rated torque."""
    return TorqueSensorHysteresis(0.0, tuple(rng.uniform(0.05, 0.5, 3).tolist()), sign(rng))


def draw_gain(rng, reducer):
    """Two to five half-waves."""
    return TorqueGainNonlinearity(0.0, rng.uniform(2.0, 5.0))


def draw_ripple(rng, reducer):
    """0.2 to 3 Hz."""
    return UnseenTorqueRipple(0.0, log_uniform(rng, 0.2, 3.0), rng.uniform(0, 2 * np.pi))
