"""Friction whose level follows the loading rate, either way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class RateDependentFriction(Effect):
    """Friction levels times a factor of the rate: logarithmic, power law or Stribeck; strength is its change per decade.

    ``with_drag`` lets the drag in the clearance change too. Source: Stribeck, VDI-Zeitschrift 46, 1902.
    """

    law: str
    direction: float
    reference: float
    with_drag: bool

    guess = 0.2
    most = 4.0

    def friction(self, run, torque_nm, half_width_nm):
        """Slider friction at this rate [N·m]."""
        return half_width_nm * self._factor(run)

    def floating_drag(self, run, drag_nm):
        """Drag at this rate [N·m]."""
        return drag_nm * self._factor(run) if self.with_drag else drag_nm

    def _factor(self, run):
        decades = np.log10(run.relative_rate / self.reference)
        if self.law == "power":
            return float(np.clip(10.0 ** (0.45 * self.direction * self.strength * decades), 0.05, 8.0))
        if self.law == "stribeck":
            decades = 1.0 - 2.0 / (1.0 + run.relative_rate / self.reference)
        return float(np.clip(1.0 + self.direction * self.strength * decades, 0.05, 8.0))


def draw(rng, reducer):
    """Three laws, both signs."""
    law = str(rng.choice(["log", "power", "stribeck"]))
    return RateDependentFriction(0.0, law, sign(rng), log_uniform(rng, 0.15, 0.6), bool(rng.integers(2)))
