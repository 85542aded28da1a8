"""Unlisted effects of the reducer and the torque sensor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.ode.chain import coupling
from backdrive_bayes.bench.ode.effect import OdeEffect
from backdrive_bayes.bench.ode.integrate import follow


@dataclass(frozen=True)
class WarmingStiffness(OdeEffect):
    """The shaft's compliance changes as the bench warms over ``scale_s``; strength is the logarithm of the whole change."""

    scale_s: float = 60.0
    direction: float = 1.0

    most = 2.0

    def alter(self, run, chain):
        """The chain whose shaft can be modulated."""
        extra = np.zeros_like(chain.table_travel)
        extra[-1] = chain.table_travel[-1]
        return chain._replace(table_extra=extra)

    def widen(self, run, time_s):
        """Warming since switch-on."""
        late = np.maximum(run.bench_time_s(time_s), 0.0)
        return np.expm1(-self.direction * self.strength * np.expm1(-late / self.scale_s))


@dataclass(frozen=True)
class RunningIn(OdeEffect):
    """Grease that was squeezed out at rest comes back with travel; strength is the extra friction at a record's start."""

    travel: float = 2.0

    most = 5.0

    def rub(self, run, time_s):
        """Friction over that of a reducer run in."""
        travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(run.load(time_s))))])
        return 1.0 + self.strength * np.exp(-travelled / self.travel)


@dataclass(frozen=True)
class Debris(OdeEffect):
    """Debris at one angle of the output raises friction there; strength is the factor above 1."""

    place: float = 0.3
    width: float = 0.05

    guess = 0.5
    most = 20.0

    def alter(self, run, chain):
        """The chain with a rough patch."""
        return chain._replace(bump=np.array([self.strength, self.place, self.width]))


@dataclass(frozen=True)
class LoadedRunout(OdeEffect):
    """Stiffness that varies as the mesh turns: travel in proportion to load and a wave of the angle; strength is at T_r."""

    period: float = 0.5
    phase: float = 0.0

    def mesh(self, run, time_s, torque, angle):
        """Angle with the mesh's own wave."""
        return angle + self.strength * torque * np.sin(2.0 * np.pi * angle / self.period + self.phase)


@dataclass(frozen=True)
class TorqueSensorHysteresis(OdeEffect):
    """The sensor's bonded gauge lags by bristles of ``bend`` (share of T_r); strength is the torque that it hides."""

    bend: float = 0.2
    direction: float = 1.0

    most = 0.2
    of_reducer = False

    def torque(self, run, time_s, torque):
        """Acting torque: what is read and what the gauge hides, which fades towards full load."""
        chain = coupling(np.array([-4.0, 0.0, 4.0]), np.array([-4.0, 0.0, 4.0]), 0.1, self.bend)
        ones = np.ones_like(torque)
        time, travel = follow(chain, time_s, torque, 0.0 * ones, ones)
        hidden = (torque - np.interp(time_s, time, travel)) / 0.1
        return torque + self.direction * self.strength * hidden * np.maximum(1.0 - torque**2, 0.0)


def draw_warming(rng, reducer):
    """One to five minutes, softer or stiffer."""
    return WarmingStiffness(0.0, log_uniform(rng, 20.0, 200.0), sign(rng))


def draw_running_in(rng, reducer):
    """Over one to four rated torques of travel."""
    return RunningIn(0.0, rng.uniform(1.0, 4.0))


def draw_debris(rng, reducer):
    """On the loaded part of either flank, a twentieth to a tenth of the range wide."""
    place = reducer.clearance_share + (1.0 - reducer.clearance_share) * rng.uniform(0.15, 0.75)
    return Debris(0.0, sign(rng) * place, rng.uniform(0.03, 0.08))


def draw_runout(rng, reducer):
    """Two to six periods in the range."""
    return LoadedRunout(0.0, log_uniform(rng, 0.3, 1.0), rng.uniform(0, 6.28))


def draw_sensor_hysteresis(rng, reducer):
    """Narrow or wide, leading or lagging."""
    return TorqueSensorHysteresis(0.0, log_uniform(rng, 0.1, 0.5), sign(rng))
