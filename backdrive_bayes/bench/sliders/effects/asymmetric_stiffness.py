"""Two flanks of different stiffness: an angle even in torque."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import sign
from backdrive_bayes.bench.sliders.effect import Effect

LAWS = ("flank", "quadratic", "late")


@dataclass(frozen=True)
class AsymmetricStiffness(Effect):
    """One flank (``side``) is softer: in proportion, growing with load, or beyond a ``knee``; strength is angle share."""

    side: float
    law: str
    knee: float

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Extra deflection of the soft flank [rad]."""
        load = np.maximum(self.side * transmitted_nm / run.reducer.rated_torque_nm, 0.0)
        if self.law == "quadratic":
            load = load**2
        elif self.law == "late":
            load = np.maximum(load - self.knee, 0.0)
        return self.strength * self.side * run.reducer.angle_rad * load


def draw(rng, reducer):
    """Either flank, three laws."""
    return AsymmetricStiffness(0.0, sign(rng), str(rng.choice(LAWS)), rng.uniform(0.15, 0.4))
