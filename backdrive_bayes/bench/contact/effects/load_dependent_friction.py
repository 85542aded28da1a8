"""Coulomb friction of flanks or bearings, on a reducer that has only constant friction otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect


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


def draw(rng, reducer):
    """At the flanks or in the bearings, these from no load on or from a preload on."""
    return LoadDependentFriction(0.0, bool(rng.integers(2)), float(rng.choice([0.0, rng.uniform(0.03, 0.1)])))
