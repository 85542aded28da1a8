"""Stiffness that grows with the load, on a reducer whose contacts are linear otherwise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect

_PER_FLANK = ("open_up", "open_down", "stiff_up", "stiff_down", "mu", "tangential")


@dataclass(frozen=True)
class HardeningStiffness(ContactEffect):
    """``law`` 'profile': the contacts' exponent grows by strength, the deflection at T_r kept; 'teeth': further teeth touch at
    ``knees`` of the deflection and bring strength times the stiffness there is; 'stop': they all touch at the first knee."""

    law: str
    knees: tuple[float, ...]

    guess = 0.1
    most = 4.0

    def chain(self, test, chain):
        """Chain with hardening contacts."""
        if self.law == "profile":
            power = chain.power_up + 0.5 * self.strength
            stiff = contact_stiffness(chain.open_up, power, chain.film, test.reducer.deflections())
            return chain._replace(stiff_up=stiff, stiff_down=stiff, power_up=power, power_down=power)
        return self._with_teeth(chain, test.reducer.deflections())

    def _with_teeth(self, chain: Chain, deflection):
        knees = np.array(self.knees if self.law == "teeth" else self.knees[:1])
        late = chain.open_up.min(axis=1, keepdims=True) + deflection[:, None] * knees
        stiff = np.broadcast_to(self.strength * chain.stiff_up.sum(axis=1, keepdims=True) / knees.size, late.shape)
        bare = np.zeros_like(late)
        more = {"open_up": late, "open_down": late, "stiff_up": stiff, "stiff_down": stiff, "mu": bare, "tangential": bare}
        return chain._replace(**{name: np.hstack([getattr(chain, name), more[name]]) for name in _PER_FLANK})


def draw(rng, reducer):
    """Rounder contacts, teeth that come in late, or a stop."""
    knees = tuple(float(k) for k in np.sort(rng.uniform(0.15, 0.75, 4)))
    return HardeningStiffness(0.0, str(rng.choice(["profile", "teeth", "stop"])), knees)
