"""Micro-slip of the clamp on the output shaft: its patches let go one after another above a threshold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.patches import joint_turn

PATCHES = 12


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
    of_reducer = False

    def deflect(self, test, run):
        """Slip, elastic turn of the gripping clamp left out."""
        if self.law == "ratchet":
            over = np.maximum(np.abs(run.load) - self.threshold, 0.0) ** (1.0 + self.spread)
            advance = np.maximum(np.diff(over), 0.0) * np.sign(run.load[1:])
            return self.strength * np.r_[0.0, np.cumsum(advance)] / (1.0 - self.threshold) ** (1.0 + self.spread)
        return self.strength * self._slip(run.load) / self._slip(np.linspace(0.0, 1.0, 200))[-1]

    def _slip(self, load):
        rank = (np.arange(PATCHES) + 0.5) / PATCHES
        go = self.threshold * (1.0 + self.spread * (rank if self.law == "annulus" else 0.1 * rank))
        stiffness = np.full(PATCHES, (1.0 - self.rest) / PATCHES)
        return joint_turn(load, stiffness, stiffness * go, self.rest) - load


def draw(rng, reducer):
    """Thresholds from half to 0.85 of the rated torque, three laws."""
    law = str(rng.choice(["annulus", "ring", "ratchet"]))
    return InterfaceSlip(0.0, law, rng.uniform(0.5, 0.85), rng.uniform(0.2, 0.8), rng.uniform(0.15, 0.5))
