"""Two flanks that differ: one side's contacts are softer, of another shape, or fewer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.chain import contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect, sign


@dataclass(frozen=True)
class AsymmetricStiffness(ContactEffect):
    """The flanks of one ``side`` give more: ``law`` 'softer' is deeper by 1 + strength at any load, 'profile' has a greater
    exponent, 'fewer' has all flanks but the first touch later by strength, in deflections at T_r."""

    side: float
    law: str

    guess = 0.1
    most = 3.0

    def chain(self, test, chain):
        """Contacts with one side changed."""
        up = self.side > 0
        touch, stiff, power = (
            (chain.open_up, chain.stiff_up, chain.power_up) if up else (chain.open_down, chain.stiff_down, chain.power_down)
        )
        if self.law == "softer":
            stiff = stiff / (1.0 + self.strength) ** power[:, None]
        elif self.law == "profile":
            deflection, old = test.reducer.deflections(), power
            power = power * (1.0 + self.strength)
            before, after = (contact_stiffness(touch, p, chain.film, deflection) for p in (old, power))
            stiff = stiff * after / before
        else:
            touch = touch + self.strength * test.reducer.deflections()[:, None] * (np.arange(touch.shape[1]) > 0)
        if up:
            return chain._replace(open_up=touch, stiff_up=stiff, power_up=power)
        return chain._replace(open_down=touch, stiff_down=stiff, power_down=power)


def draw(rng, reducer):
    """Either side, three laws."""
    return AsymmetricStiffness(0.0, sign(rng), str(rng.choice(["softer", "softer", "profile", "fewer"])))
