"""Micro-slip of the output clamp: above a threshold of torque, while it grows, and kept until the torque reverses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench import elements
from backdrive_bayes.bench.effect import Effect

LAWS = ("linear", "accelerating", "saturating")


@dataclass(frozen=True)
class InterfaceSlip(Effect):
    """Contact patches let go one after another from ``threshold`` on (share of rated torque); strength is angle share.

    Source: partial slip of clamped joints, Johnson, Contact Mechanics, 1985, section 7.2.
    """

    threshold: float
    patches_spread: float
    law: str

    of_reducer = False

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Slip [rad]."""
        patches = self.threshold + self.patches_spread * np.linspace(-1, 1, 9)

        def advance(size_nm):
            over = np.maximum(size_nm[:, None] / run.reducer.rated_torque_nm - patches, 0.0).mean(axis=1)
            if self.law == "accelerating":
                return over + 4.0 * over**2
            return 0.15 * np.log1p(over / 0.15) if self.law == "saturating" else over

        return self.strength * run.reducer.angle_rad * elements.slip_while_loading(torque_nm, advance)


def draw(rng, reducer):
    """Thresholds from half to nine tenths of the rated torque."""
    return InterfaceSlip(0.0, rng.uniform(0.5, 0.85), rng.uniform(0.01, 0.06), str(rng.choice(LAWS)))
