"""Friction that follows the sliding speed, at the flanks, in the bearings, or in both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.drawing import log_uniform
from backdrive_bayes.bench.contact.effect import ContactEffect, sign


@dataclass(frozen=True)
class RateDependentFriction(ContactEffect):
    """Friction times a factor of each stage's sliding speed over ``reference`` (loads per second); strength scales its change.

    ``law`` 'film' is logarithmic (thermally activated), 'stribeck' falls from one level to another, 'viscous' rises or falls in
    proportion; ``flanks`` and ``bearings`` say which friction follows. Source: Persson, Sliding Friction, 2000, chapter 7.
    """

    law: str
    direction: float
    reference: float
    flanks: bool
    bearings: bool

    guess = 0.1
    most = 3.0

    def chain(self, test, chain):
        """Chain with friction at this record's speed."""
        share = test.reducer.deflections() / test.reducer.deflections().max()
        speed = test.relative_rate * np.sqrt(share) / self.reference
        if self.law == "film":
            change = np.log10(speed)
        elif self.law == "stribeck":
            change = 0.5 - np.exp(-(speed**0.8))
        else:
            change = speed - 1.0
        factor = np.clip(1.0 + self.direction * self.strength * change, 0.05, 6.0)[:, None]
        mu = np.minimum(chain.mu * factor, 0.85) if self.flanks else chain.mu
        bearing = chain.bearing * factor if self.bearings else chain.bearing
        return chain._replace(mu=mu, bearing=bearing)


def draw(rng, reducer):
    """Three laws, both signs; bearings alone, flanks alone, or both."""
    law, where = str(rng.choice(["film", "stribeck", "viscous"])), int(rng.choice(3, p=[0.2, 0.2, 0.6]))
    flanks = where != 0 and reducer.flank_friction > 0.0
    return RateDependentFriction(0.0, law, sign(rng), log_uniform(rng, 0.2, 0.6), flanks, where != 1 or not flanks)
