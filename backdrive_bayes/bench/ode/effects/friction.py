"""Effects of the bristles' level: growing with the load, and following the speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.ode import bristles
from backdrive_bayes.bench.ode.effect import OdeEffect

LAWS = {"logarithm": bristles.LOGARITHM, "power": bristles.POWER, "saturating": bristles.SATURATING}


@dataclass(frozen=True)
class LoadDependentFriction(OdeEffect):
    """Friction that follows ``power`` of the torque passed on, divided among the nodes by ``share``; strength is its ratio.

    Where the reducer has such friction of its own, the power is 1, like that one's.
    """

    share: tuple[float, ...] = (0.4, 0.3, 0.3)
    power: float = 1.0

    guess = 0.03
    most = 0.6

    def alter(self, run, chain):
        """The chain with more friction under load."""
        power = self.power if run.reducer.load_friction == 0.0 else 1.0
        return chain._replace(ratio=chain.ratio + self.strength * np.array(self.share), load_power=power)


@dataclass(frozen=True)
class RateDependentFriction(OdeEffect):
    """A level of sliding friction that follows the nodes' speed by ``law``; strength is its change over the measure.

    A rising level answers at once. A falling one (``direction`` -1) has a small instant rise and a larger fall that is
    remembered over the slip ``distance``: Ruina, J. Geophys. Res. 88, 1983. ``reference`` is a speed in angle scales per second.
    """

    law: str = "logarithm"
    direction: float = 1.0
    reference: float = 0.1
    distance: float = 0.2
    power: float = 0.4

    guess = 0.1
    most = 2.0

    def alter(self, run, chain):
        """The chain with this rate law."""
        instant, later = (1.0, 0.0) if self.direction > 0 else (0.25, -1.25)
        numbers = [LAWS[self.law], self.reference, instant * self.strength, later * self.strength, self.distance, self.power]
        return chain._replace(rate_law=np.array(numbers))


def draw_load(rng, reducer):
    """Mostly at the output, evenly, or mostly at the input; by Hertz's power, in proportion, or steeper."""
    share = tuple(rng.dirichlet([2.0, 1.0, 2.0]).tolist())
    return LoadDependentFriction(0.0, share, float(rng.choice([0.67, 1.0, rng.uniform(1.2, 1.8)])))


def draw_rate(rng, reducer):
    """Three laws, both signs."""
    law = str(rng.choice(list(LAWS)))
    reference = {"logarithm": (0.02, 0.1), "power": (0.3, 1.0), "saturating": (0.2, 0.8)}[law]
    direction = sign(rng)
    power = rng.uniform(0.3, 0.6) if law == "power" else rng.uniform(0.7, 1.3)
    return RateDependentFriction(0.0, law, direction, log_uniform(rng, *reference), log_uniform(rng, 0.05, 0.3), power)
