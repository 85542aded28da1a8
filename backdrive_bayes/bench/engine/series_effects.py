"""Effects that are a part in series with the output: clamp, polymer, second stage."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.engine.effect import EngineEffect
from backdrive_bayes.bench.engine.hinge import Hinge, hinge_angle


@dataclass(frozen=True)
class InterfaceSlip(EngineEffect):
    """The output clamp slips above friction torques ``thresholds`` over T_r.

    ``strength`` is its slip at T_r over the angle scale. It stays where it slipped to until the torque has turned round by twice
    its friction.
    """

    thresholds: tuple[float, ...] = (0.8,)

    most = 0.5

    def series(self, run, load):
        """Mean slip of the clamping faces [rad]."""
        faces = [hinge_angle(Hinge(1.0 - t, friction=t), load, run.steps.step_s) for t in self.thresholds]
        return self.strength * run.reducer.angle_rad * np.mean(faces, axis=0)


def draw_interface_slip(rng, reducer):
    """One face, or two or three that let go one after another."""
    count = int(rng.integers(1, 4))
    first = rng.uniform(0.5, 0.85)
    return InterfaceSlip(thresholds=tuple(np.linspace(first, min(first + 0.2, 0.93), count).round(3).tolist()))


@dataclass(frozen=True)
class ViscoelasticCreep(EngineEffect):
    """Polymer in series: springs with dashpots of ``relaxation_s`` [s]; ``strength`` is its relaxed deflection at T_r.

    With a ``yield_torque`` (over T_r) it creeps only by what exceeds that.
    """

    relaxation_s: tuple[float, ...] = (3.0,)
    yield_torque: float = 0.0

    most = 0.6

    def series(self, run, load):
        """Mean of the delayed springs [rad]."""
        hinges = [Hinge(1.0, friction=self.yield_torque, relaxation_s=s) for s in self.relaxation_s]
        return self.strength * run.reducer.angle_rad * np.mean([hinge_angle(h, load, run.steps.step_s) for h in hinges], axis=0)


def draw_viscoelastic_creep(rng, reducer):
    """One relaxation time, a spectrum of three, or creep beyond a yield torque."""
    variant = str(rng.choice(["single", "spectrum", "yield"]))
    time = log_uniform(rng, 0.8, 20.0)
    times = tuple(time * f for f in (0.2, 1.0, 4.0)) if variant == "spectrum" else (time,)
    return ViscoelasticCreep(relaxation_s=times, yield_torque=float(rng.uniform(0.1, 0.4)) if variant == "yield" else 0.0)


@dataclass(frozen=True)
class SecondBacklash(EngineEffect):
    """Another stage's clearance, crossed at ``drag`` over T_r against a soft spring.

    ``strength`` is half of it over the angle scale.
    """

    drag: float = 0.2
    crossing: float = 0.03

    most = 0.5

    def series(self, run, load):
        """Angle between the stops [rad]."""
        hinge = Hinge(self.crossing, friction=self.drag, stops=(-1.0, 1.0))
        return self.strength * run.reducer.angle_rad * hinge_angle(hinge, load, run.steps.step_s)


def draw_second_backlash(rng, reducer):
    """A drag well above what the reducer's own clearances take."""
    own = reducer.drag + reducer.friction + reducer.load_friction * 0.1
    drag = max(2.0 * own, 0.1) * rng.uniform(1.0, 2.0)
    return SecondBacklash(drag=float(min(drag, 0.5)), crossing=log_uniform(rng, 0.01, 0.06))
