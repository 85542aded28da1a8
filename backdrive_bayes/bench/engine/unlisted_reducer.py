"""Unlisted effects of the reducer and its mounting."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.engine.effect import EngineEffect
from backdrive_bayes.bench.engine.hinge import Hinge, hinge_angle


@dataclass(frozen=True)
class Cogging(EngineEffect):
    """A detent torque of ``strength`` over T_r, periodic in the output's angle (``period`` over the angle scale)."""

    period: float = 0.3
    phase: float = 0.0

    guess = 0.005
    most = 0.2

    def train(self, run, train):
        """The detent acts on the output body."""
        return replace(train, cogging=(self.strength, self.period, self.phase))


def draw_cogging(rng, reducer):
    """A few detents within the range."""
    return Cogging(period=log_uniform(rng, 0.25, 0.8), phase=float(rng.uniform(0.0, 2.0 * np.pi)))


@dataclass(frozen=True)
class RunningIn(EngineEffect):
    """Bearings lose the share ``strength`` of their friction as they turn during a record, and regain it at rest."""

    guess = 0.1
    most = 0.9

    def train(self, run, train):
        """Bearings that run in."""
        return replace(train, running_in=self.strength)


def draw_running_in(rng, reducer):
    """No parameters beside the strength."""
    return RunningIn()


@dataclass(frozen=True)
class LiftOff(EngineEffect):
    """A preloaded joint of the housing opens elastically on one side above ``preload`` over T_r.

    ``strength`` is its opening at T_r over the angle scale.
    """

    preload: float = 0.6
    side: float = 1.0

    most = 0.5

    def series(self, run, load):
        """The joint's opening [rad]."""
        hinge = Hinge(1.0 - self.preload, preload=self.preload, stops=(0.0, 1e6))
        return self.strength * self.side * run.reducer.angle_rad * hinge_angle(hinge, self.side * load, run.steps.step_s)


def draw_lift_off(rng, reducer):
    """A preload and a side."""
    return LiftOff(preload=float(rng.uniform(0.3, 0.8)), side=sign(rng))


@dataclass(frozen=True)
class WarmStiffness(EngineEffect):
    """All links are more compliant by the share ``strength`` x (1 - exp(-start / ``warming_s``)) in later records."""

    warming_s: float = 100.0

    guess = 0.05
    most = 0.6

    def train(self, run, train):
        """Warm links."""
        warm = 1.0 + self.strength * (1.0 - float(np.exp(-max(run.where.start_s, 0.0) / self.warming_s)))
        return replace(train, links=tuple(replace(k, compliance=k.compliance * warm) for k in train.links))


def draw_warm_stiffness(rng, reducer):
    """A warming time."""
    return WarmStiffness(warming_s=log_uniform(rng, 40.0, 300.0))


@dataclass(frozen=True)
class ToothDefect(EngineEffect):
    """A damaged tooth turns the output by ``strength`` more or less near one angle (``at``, ``width`` over the angle scale)."""

    at: float = 0.4
    width: float = 0.08
    sign: float = 1.0

    most = 0.3

    def transmit(self, run, angle_rad):
        """A smooth bump of the transmission's kinematics."""
        distance = (angle_rad / run.reducer.angle_rad - self.at) / self.width
        return angle_rad + self.sign * self.strength * run.reducer.angle_rad / np.cosh(distance) ** 2


def draw_tooth_defect(rng, reducer):
    """Anywhere in the range, on either side."""
    at = float(rng.uniform(0.15, 0.85) * rng.choice([-1.0, 1.0]))
    return ToothDefect(at=at, width=log_uniform(rng, 0.03, 0.15), sign=sign(rng))
