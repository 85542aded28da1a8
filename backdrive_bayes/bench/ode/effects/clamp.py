"""Micro-slip of the output clamp near full load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.ode.chain import coupling
from backdrive_bayes.bench.ode.effect import OdeEffect
from backdrive_bayes.bench.ode.integrate import follow

FULL = 0.985
"""Largest share of the holding torque that is reached."""


@dataclass(frozen=True)
class DahlClamp(OdeEffect):
    """A Dahl joint that holds up to ``holding`` rated torques; strength is its slip from 0 to T_r, in angle scales.

    Slip per torque is (1 - s τ/holding)^-``exponent`` less the elastic part. Source: Dahl, Aerospace Corp. TOR-158, 1968.
    """

    holding: float = 1.1
    exponent: float = 3.0

    def series(self, run, time_s, torque):
        """Slip that grows while the load does."""
        begin, end = torque[:-1], torque[1:]
        side = np.sign(end - begin)
        slip = side * np.maximum(self._slipped(side * end) - self._slipped(side * begin), 0.0)
        return time_s, self.strength / self._slipped(1.0) * np.concatenate([[0.0], np.cumsum(slip)])

    def _slipped(self, load):
        share = np.clip(load / self.holding, 0.0, FULL)
        power = 1.0 - self.exponent
        return self.holding * (((1.0 - share) ** power - 1.0) / -power - share)


@dataclass(frozen=True)
class BackedClamp(OdeEffect):
    """A bristle joint that lets go at ``holding`` rated torques, with a spring behind it; strength is its slip at T_r."""

    holding: float = 0.7
    rounding: float = 0.03

    def series(self, run, time_s, torque):
        """Slip against the spring."""
        slope = 1.0 / (1.0 - self.holding)
        chain = coupling(np.array([-2.0, 0.0, 2.0]), np.array([-2.0, 0.0, 2.0]) * slope, self.holding, self.rounding)
        time, slip = follow(chain, time_s, torque, np.zeros_like(torque), np.ones_like(torque))
        return time, self.strength * slip


def draw(rng, reducer):
    """Two of three clamps let go over a range of torque, the third has a spring behind it."""
    if rng.uniform() < 0.67:
        return DahlClamp(0.0, rng.uniform(1.04, 1.25), rng.uniform(2.0, 4.5))
    return BackedClamp(0.0, rng.uniform(0.55, 0.85), rng.uniform(0.01, 0.08))
