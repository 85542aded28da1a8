"""Parts in series on the output side: a second clearance, and a clamp that slips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.patches import joint_turn
from backdrive_bayes.bench.contact.solver import follow


@dataclass(frozen=True)
class SecondBacklash(ContactEffect):
    """One more mesh in series, of ``flanks`` contacts that touch over ``scatter`` of the clearance; strength is it, angle share.

    ``drag`` (share of T_r) holds the joint up to where it crosses, over a torque range of ``film``; ``hertz`` is the exponent of
    its contacts, whose depth at T_r is ``depth`` of the clearance.
    """

    drag: float
    film: float
    flanks: int
    scatter: float
    hertz: float
    depth: float

    guess = 0.05

    def deflect(self, test, run):
        """Turn of the joint."""
        touch = 0.5 + np.linspace(0.0, self.scatter, self.flanks)[None, :]
        film, power = np.array([2.0 * self.film]), np.array([self.hertz])
        stiff = contact_stiffness(touch, power, film, np.array([self.depth + self.scatter]))
        bearing, none = self.drag * np.array([[0.2, 0.3, 0.3, 0.2]]), np.zeros_like(touch)
        bristle = bearing / (0.04 * np.array([[0.5, 0.8, 1.2, 1.5]]))
        joint = Chain(touch, touch, stiff, stiff, power, power, none, none, film, bearing, bristle, np.zeros(1))
        rows = follow(joint, run.time_s, run.load, np.zeros(1), 0.02)
        return self.strength * np.interp(run.time_s, rows[:, 0], rows[:, 1])


def draw_second_backlash(rng, reducer):
    """Drags of three to eight times the bearings', at least a tenth of the rated torque; one to four flanks."""
    drag = float(np.clip(reducer.drag * rng.uniform(3.0, 8.0), rng.uniform(0.1, 0.25), 0.5))
    return SecondBacklash(
        0.0, drag, drag * rng.uniform(0.05, 0.4), int(rng.integers(1, 5)), rng.uniform(0.0, 0.2), rng.uniform(1.0, 1.5),
        rng.uniform(0.02, 0.15),
    )  # fmt: skip


@dataclass(frozen=True)
class InterfaceSlip(ContactEffect):
    """Friction patches in parallel, gripping up to ``threshold`` (share of T_r) and beyond; strength is slip at T_r, angle share.

    ``law`` 'annulus' lets patches go over ``spread`` with a steep middle, 'ring' nearly at once against the clamp's ``rest``
    stiffness, and 'ratchet' has nothing that pushes back: it slips only while the torque grows. Source: Johnson, Contact
    Mechanics, 1985, section 7.2.
    """

    law: str
    threshold: float
    spread: float
    rest: float

    guess = 0.02

    def deflect(self, test, run):
        """Slip, elastic turn of the gripping clamp left out."""
        if self.law == "ratchet":
            over = np.maximum(np.abs(run.load) - self.threshold, 0.0) ** (1.0 + self.spread)
            advance = np.maximum(np.diff(over), 0.0) * np.sign(run.load[1:])
            return self.strength * np.r_[0.0, np.cumsum(advance)] / (1.0 - self.threshold) ** (1.0 + self.spread)
        return self.strength * self._slip(run.load) / self._slip(np.linspace(0.0, 1.0, 200))[-1]

    def _slip(self, load):
        rank = (np.arange(12) + 0.5) / 12
        go = self.threshold * (1.0 + self.spread * (rank if self.law == "annulus" else 0.1 * rank))
        stiffness = np.full(rank.size, (1.0 - self.rest) / rank.size)
        return joint_turn(load, stiffness, stiffness * go, self.rest) - load


def draw_interface_slip(rng, reducer):
    """Thresholds from half to 0.85 of the rated torque, three laws."""
    law = str(rng.choice(["annulus", "ring", "ratchet"]))
    return InterfaceSlip(0.0, law, rng.uniform(0.5, 0.85), rng.uniform(0.2, 0.8), rng.uniform(0.15, 0.5))
