"""Friction in proportion to the load, on a reducer that otherwise has none of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.sliders.effect import Effect
from backdrive_bayes.bench.sliders.reducer import slider_levels


@dataclass(frozen=True)
class LoadDependentFriction(Effect):
    """Each slider holds back more in proportion to the load beyond ``onset``; strength is the mean ratio."""

    spread: float
    onset: float

    guess = 0.03
    most = 0.6

    def friction(self, run, torque_nm, half_width_nm):
        """Slider friction with the load's part [N·m]."""
        load = np.maximum(np.abs(torque_nm) - self.onset * run.reducer.rated_torque_nm, 0.0)
        return half_width_nm + self.strength * load[:, None] * slider_levels(self.spread)[1]


def draw(rng, reducer):
    """Equal or spread ratios, from no load on or from a preload on."""
    return LoadDependentFriction(0.0, rng.uniform(0.02, 0.7), float(rng.choice([0.0, rng.uniform(0.05, 0.2)])))
