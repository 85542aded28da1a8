"""Effects that are the train's own: its flanks and its bearings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.engine.effect import EngineEffect
from backdrive_bayes.bench.engine.hinge import Hinge, hinge_angle


@dataclass(frozen=True)
class AsymmetricStiffness(EngineEffect):
    """Flanks of one side more compliant: by 1 ± ``strength`` where links have clearance, else one-sided play in a key.

    ``side`` is 1 or -1.
    """

    side: float = 1.0
    in_train: bool = True

    guess = 0.05
    most = 0.7

    def train(self, run, train):
        """Flanks of unlike compliance."""
        if not self.in_train or not self.strength:
            return train
        links = tuple(replace(k, asymmetry=self.side * self.strength) if k.clearance else k for k in train.links)
        return replace(train, links=links)

    def series(self, run, load):
        """A spring that only one flank loads [rad]."""
        if self.in_train:
            return 0.0
        pressed = hinge_angle(Hinge(1.0, stops=(0.0, 1e6)), self.side * load, run.steps.step_s)
        return 0.5 * self.strength * self.side * run.reducer.angle_rad * pressed


def draw_asymmetric_stiffness(rng, reducer):
    """In the flanks of the links with clearance, where there are any."""
    return AsymmetricStiffness(side=sign(rng), in_train=bool(reducer.gaps) and rng.uniform() < 0.7)


@dataclass(frozen=True)
class StickSlip(EngineEffect):
    """Static friction of all loaded bearings above the kinetic one by the share ``strength``."""

    guess = 0.2
    most = 2.5

    def train(self, run, train):
        """Bearings that break loose."""
        return replace(train, static=train.static + self.strength)


def draw_stick_slip(rng, reducer):
    """No parameters beside the strength."""
    return StickSlip()


@dataclass(frozen=True)
class RateDependentFriction(EngineEffect):
    """Bearing friction that changes by the share ``strength`` from the loading rate ``reference`` [T_r/s] on, by a ``law``.

    log: with the logarithm of the rate; stribeck: falls as the lubricant carries; viscous: a drag in proportion to the bearings'
    true speed. ``direction`` is 1 where friction grows with the rate.
    """

    law: str = "log"
    direction: float = 1.0
    reference: float = 0.3

    guess = 0.1
    most = 0.9

    def train(self, run, train):
        """Bearings at this rate."""
        if self.law == "viscous":
            level = sum(train.friction) + 0.5 * sum(train.load_friction)
            return replace(train, viscous=train.viscous + self.strength * level / len(train.friction) / self.reference)
        rate = run.relative_rate / self.reference
        change = np.tanh(0.5 * np.log(rate)) if self.law == "log" else 1.0 - 2.0 * np.exp(-rate)
        level = 1.0 + self.strength * self.direction * float(change)
        scale = {name: tuple(level * f for f in getattr(train, name)) for name in ("friction", "load_friction")}
        return replace(train, **scale)


def draw_rate_dependent_friction(rng, reducer):
    """A law and, but for the viscous one, either sign."""
    law = str(rng.choice(["log", "stribeck", "viscous"]))
    direction = {"log": sign(rng), "stribeck": -1.0, "viscous": 1.0}[law]
    return RateDependentFriction(law=law, direction=direction, reference=log_uniform(rng, 0.2, 0.6))


@dataclass(frozen=True)
class LoadDependentFriction(EngineEffect):
    """Bearing friction that grows with the torque passed on, by ``strength`` in all; ``shares`` (bodies,) says where."""

    shares: tuple[float, ...] = ()

    guess = 0.05
    most = 0.5

    def train(self, run, train):
        """Bearings pressed by the load."""
        added = tuple(f + self.strength * s for f, s in zip(train.load_friction, self.shares, strict=True))
        return replace(train, load_friction=added)


def draw_load_dependent_friction(rng, reducer):
    """Unevenly over the bearings, none at the output flange."""
    shares = rng.uniform(0.3, 1.7, len(reducer.weights[1]))
    shares[0] = 0.0
    return LoadDependentFriction(shares=tuple((shares / shares.sum()).tolist()))


@dataclass(frozen=True)
class HardeningStiffness(EngineEffect):
    """Stiffness that grows with the deflection in the links of ``where``: by ``strength`` in its logarithm."""

    where: tuple[bool, ...] = ()

    guess = 0.1
    most = 0.9

    def train(self, run, train):
        """Stiffening links, as compliant at T_r as before."""
        if not self.strength:
            return train
        more = float(np.exp(self.strength))
        pairs = zip(train.links, self.where, strict=True)
        return replace(train, links=tuple(replace(k, stiffening=k.stiffening * more) if on else k for k, on in pairs))


def draw_hardening_stiffness(rng, reducer):
    """All links, or those with clearance only."""
    count = len(reducer.weights[2])
    meshes = bool(reducer.gaps) and rng.uniform() < 0.4
    return HardeningStiffness(where=tuple(not meshes or i in reducer.gaps for i in range(count)))
