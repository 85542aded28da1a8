"""Effects of the springs: flanks that differ, stiffness that follows the load, and delayed compliance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.relaxation import relax, yielding_relax
from backdrive_bayes.bench.draws import log_uniform, sign


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


def draw_asymmetric_stiffness(rng, reducer):
    """Either side, three laws."""
    return AsymmetricStiffness(0.0, sign(rng), str(rng.choice(["softer", "softer", "profile", "fewer"])))


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


def draw_hardening_stiffness(rng, reducer):
    """Rounder contacts, teeth that come in late, or a stop."""
    knees = tuple(float(k) for k in np.sort(rng.uniform(0.15, 0.75, 4)))
    return HardeningStiffness(0.0, str(rng.choice(["profile", "teeth", "stop"])), knees)


@dataclass(frozen=True)
class ViscoelasticCreep(ContactEffect):
    """Teeth that go on bending under load; strength is the delayed turn at T_r once relaxed, angle share.

    ``law`` 'bending' is one Kelvin element, 'prony' three with constants a factor ``ratio`` apart, 'indentation' grows with
    load^(2/3) (Lee and Radok, J. Appl. Mech. 27, 1960), 'yield' rests within ``threshold`` of its target.
    """

    law: str
    constant_s: float
    ratio: float
    threshold: float

    guess = 0.05

    def deflect(self, test, run):
        """Delayed turn of all stages, softer stages creeping more."""
        weight = test.reducer.deflections() / test.reducer.elastic_share
        load = run.mesh @ weight
        if self.law == "indentation":
            load = np.sign(load) * np.abs(load) ** (2.0 / 3.0)
        if self.law == "yield":
            return self.strength * yielding_relax(run.time_s, load, self.constant_s, self.threshold)
        constants = [self.constant_s]
        if self.law == "prony":
            constants = [self.constant_s / self.ratio, self.constant_s, self.constant_s * self.ratio]
        return self.strength * np.mean([relax(run.time_s, load, complex(c)).real for c in constants], axis=0)


def draw_viscoelastic_creep(rng, reducer):
    """Time constants from half a second to half a minute, four laws."""
    law = str(rng.choice(["bending", "prony", "indentation", "yield"]))
    return ViscoelasticCreep(0.0, law, log_uniform(rng, 0.5, 30.0), rng.uniform(3.0, 8.0), rng.uniform(0.1, 0.35))
