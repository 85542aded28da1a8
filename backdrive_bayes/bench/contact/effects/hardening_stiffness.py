"""Stiffness that grows with the load, on a reducer whose contacts are linear otherwise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect


@dataclass(frozen=True)
class HardeningStiffness(ContactEffect):
    """``law`` 'profile': the contacts' exponent grows by strength, the deflection at T_r kept; 'teeth': further teeth touch at
    ``knees`` of the deflection and bring strength times the stiffness there is; 'stop': they all touch at the first knee."""

    law: str
    knees: tuple[float, ...]

    guess = 0.1
    most = 8.0

    def chain(self, test, chain):
        """Chain with hardening contacts."""
        deflection = test.reducer.deflections()
        if self.law == "profile":
            return self._rounder(chain, deflection)
        return self._with_teeth(chain, deflection)

    def _rounder(self, chain: Chain, deflection):
        changed: dict[str, Any] = {}
        for side in ("up", "down"):
            touch, stiff, power = (getattr(chain, f"{name}_{side}") for name in ("open", "stiff", "power"))
            before, after = (contact_stiffness(touch, p, chain.film, deflection) for p in (power, power + 0.5 * self.strength))
            changed |= {f"stiff_{side}": stiff * after / before, f"power_{side}": power + 0.5 * self.strength}
        return chain._replace(**changed)

    def _with_teeth(self, chain: Chain, deflection):
        knees = np.array(self.knees if self.law == "teeth" else self.knees[:1])
        bare = np.zeros((deflection.size, knees.size))
        more: dict[str, Any] = {"mu": bare, "tangential": bare}
        for side in ("up", "down"):
            touch, stiff = getattr(chain, f"open_{side}"), getattr(chain, f"stiff_{side}")
            more[f"open_{side}"] = touch.min(axis=1, keepdims=True) + deflection[:, None] * knees
            more[f"stiff_{side}"] = bare + self.strength * stiff.sum(axis=1, keepdims=True) / knees.size
        wider: dict[str, Any] = {name: np.hstack([getattr(chain, name), added]) for name, added in more.items()}
        return chain._replace(**wider)


def draw(rng, reducer):
    """Rounder contacts, teeth that come in late, or a stop."""
    knees = tuple(float(k) for k in np.sort(rng.uniform(0.15, 0.75, 4)))
    return HardeningStiffness(0.0, str(rng.choice(["profile", "teeth", "stop"])), knees)
