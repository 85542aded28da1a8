"""The clearance of a second stage, crossed at a torque of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.sliders import elements
from backdrive_bayes.bench.sliders.effect import Effect

PARTS = 9


@dataclass(frozen=True)
class SecondBacklash(Effect):
    """Parts that float with ``drag`` and engage within ``engagement`` (shares of rated torque); strength is angle share."""

    drag: float
    engagement: float
    uneven: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Angle from the second clearance [rad]."""
        rated, place = run.reducer.rated_torque_nm, np.linspace(-1.0, 1.0, PARTS)
        drag = np.full((torque_nm.size, PARTS), rated * self.drag) * (1.0 + self.uneven * place)
        width = np.full(PARTS, rated * self.engagement / 3)
        moved = elements.gaps(torque_nm, drag, rated * self.engagement * place, width, width)
        return 0.5 * self.strength * run.reducer.angle_rad * moved.mean(axis=1)


def draw(rng, reducer):
    """A second step well apart from the first, where settled loops still cross it."""
    drag = rng.uniform(max(0.12, 3 * reducer.drag), 0.5)
    return SecondBacklash(0.0, drag, log_uniform(rng, 0.01, 0.06), rng.uniform(0.0, 0.15))
