"""Effects of the friction: in jumps, following the rate, and growing with the load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.draws import log_uniform, sign


@dataclass(frozen=True)
class StickSlip(ContactEffect):
    """Friction that falls from its static to its kinetic level by strength (share of T_r) each time it breaks.

    It builds up again over ``spacing``, a share of that shaft's turn, on the seal of the ``body``-th shaft; ``kinetic`` is the
    kinetic level over that fall.
    """

    spacing: float
    kinetic: float
    body: int

    most = 0.3

    def chain(self, test, chain):
        """Chain with the brittle contact."""
        reducer, fall = test.reducer, self.strength
        spacing = self.spacing * (reducer.floating_angles(1.0)[self.body] + reducer.deflections()[self.body :].sum())
        return chain._replace(stick=np.array([self.body, fall * (1.0 + self.kinetic), fall * self.kinetic, fall / spacing]))


def draw_stick_slip(rng, reducer):
    """On the output shaft, or on the next."""
    return StickSlip(0.0, log_uniform(rng, 0.008, 0.05), rng.uniform(0.0, 0.6), int(rng.integers(min(2, reducer.stages))))


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


def draw_rate_dependent_friction(rng, reducer):
    """Three laws, both signs; bearings alone, flanks alone, or both."""
    law, where = str(rng.choice(["film", "stribeck", "viscous"])), int(rng.choice(3, p=[0.2, 0.2, 0.6]))
    flanks = where != 0 and reducer.flank_friction > 0.0
    return RateDependentFriction(0.0, law, sign(rng), log_uniform(rng, 0.2, 0.6), flanks, where != 1 or not flanks)


@dataclass(frozen=True)
class LoadDependentFriction(ContactEffect):
    """Friction that grows with load by strength, its ratio: at the ``flanks``, or in the bearings beyond ``onset`` of T_r."""

    flanks: bool
    onset: float

    guess = 0.03
    most = 0.6

    def chain(self, test, chain):
        """Chain with the greater friction."""
        if self.flanks:
            # Flanks that barely grip tangentially would stay elastic; the grip only acts where there is friction.
            firm = chain.tangential * (1.0 + 10.0 * self.strength)
            level, mu = test.reducer.flank_levels(), chain.mu.copy()
            mu[:, : level.shape[1]] += self.strength * level
            return chain._replace(mu=mu, tangential=firm)
        # The output bearing takes most of the load; a stage further in turns faster under less of it.
        level = 0.4 ** np.arange(test.reducer.stages)
        level /= level.sum()
        firm = level[:, None] / chain.bristle.shape[1] / test.reducer.presliding
        return chain._replace(
            bearing_load=self.strength * level, bearing_onset=self.onset, bristle=chain.bristle + self.strength * firm
        )


def draw_load_dependent_friction(rng, reducer):
    """At the flanks or in the bearings, these from no load on or from a preload on."""
    return LoadDependentFriction(0.0, bool(rng.integers(2)), float(rng.choice([0.0, rng.uniform(0.03, 0.1)])))
