"""Effects of the chain's springs: flanks that differ, hardening, and delayed compliance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.ode.effect import OdeEffect


def hertz(load, rounding=0.02):
    """Travel of a Hertz contact at ``load``, without its infinite slope at zero; odd."""
    return np.sign(load) * ((load**2 + rounding**2) ** (1.0 / 3.0) - rounding ** (2.0 / 3.0))


@dataclass(frozen=True)
class AsymmetricStiffness(OdeEffect):
    """One flank (``side``) of element ``place`` gives more: in proportion, as a Hertz contact, or beyond a ``knee``.

    Strength is what it gives at T_r, in angle scales.
    """

    side: float = 1.0
    law: str = "flank"
    knee: float = 0.3
    place: int = 0

    def alter(self, run, chain):
        """The chain with one flank softer."""
        travel, load = chain.table_travel.copy(), np.maximum(self.side * chain.table_torque[self.place], 0.0)
        travel[self.place] += self.side * self.strength * self._given(load)
        return chain._replace(table_travel=travel)

    def _given(self, load):
        if self.law == "hertz":
            return hertz(load)
        return np.maximum(load - self.knee, 0.0) ** 1.3 / (1.0 - self.knee) ** 1.3 if self.law == "late" else load


@dataclass(frozen=True)
class HardeningStiffness(OdeEffect):
    """A bush before the locked input that bottoms at ``knee``, is a Hertz contact, or softens; strength is its travel at T_r."""

    law: str = "bush"
    knee: float = 0.3

    most = 2.0

    def alter(self, run, chain):
        """The chain with the bush in its lowest element."""
        travel, load = chain.table_travel.copy(), chain.table_torque[-1]
        laws = {"bush": np.tanh(load / self.knee), "hertz": hertz(load), "softening": load * np.abs(load) ** (0.5 / self.knee)}
        travel[-1] += self.strength * laws[self.law]
        return chain._replace(table_travel=travel)


@dataclass(frozen=True)
class ViscoelasticCreep(OdeEffect):
    """Kelvin-Voigt elements in the lowest element; strength is their final travel at T_r in angle scales.

    ``time_s`` are their time constants [s], ``share`` how they divide the travel, ``power`` the exponent of the load.
    """

    time_s: tuple[float, ...] = (3.0,)
    share: tuple[float, ...] = (1.0,)
    power: float = 1.0

    def alter(self, run, chain):
        """The chain with creep."""
        compliance = self.strength * np.array(self.share)
        return chain._replace(creep_compliance=compliance, creep_s=np.array(self.time_s), creep_power=self.power)


def draw_asymmetric(rng, reducer):
    """Either flank of the output mesh or the shaft, three laws."""
    law = str(rng.choice(["flank", "hertz", "late"]))
    return AsymmetricStiffness(0.0, sign(rng), law, rng.uniform(0.15, 0.45), int(rng.choice([0, 2])))


def draw_hardening(rng, reducer):
    """Three laws."""
    return HardeningStiffness(0.0, str(rng.choice(["bush", "hertz", "softening"])), rng.uniform(0.15, 0.5))


def draw_creep(rng, reducer):
    """One time constant, three of them, or one that follows a power of the load; half a second to half a minute."""
    variant = rng.integers(3)
    if variant == 1:
        first, parts = log_uniform(rng, 0.4, 2.0), rng.dirichlet([3.0, 3.0, 3.0])
        spacing = rng.uniform(3.0, 6.0)
        return ViscoelasticCreep(0.0, (first, first * spacing, first * spacing**2), tuple(parts.tolist()))
    return ViscoelasticCreep(0.0, (log_uniform(rng, 0.5, 30.0),), (1.0,), 1.0 if variant == 0 else rng.uniform(1.4, 2.5))
