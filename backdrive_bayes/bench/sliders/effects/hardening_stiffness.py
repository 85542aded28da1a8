"""Stiffness that changes with the load, on a reducer that is otherwise linear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.sliders.effect import Effect

LAWS = ("segments", "cubic", "softening")


@dataclass(frozen=True)
class HardeningStiffness(Effect):
    """Deflection taken away as the load grows (segment springs, or a polynomial), or added; strength is angle share.

    ``knee`` is the share of rated torque near which teeth come into or out of contact.
    """

    law: str
    knee: float

    most = 0.9

    def deflect(self, run, torque_nm, transmitted_nm, angle_rad):
        """Change of the deflection [rad]."""
        load = transmitted_nm / run.reducer.rated_torque_nm
        size = np.abs(load)
        if self.law == "segments":
            knees = self.knee * np.linspace(0.4, 1.6, 7)
            change = -np.maximum(size[:, None] - knees, 0.0).mean(axis=1)
        elif self.law == "cubic":
            change = -(size**3) / 3.0
        else:
            change = np.maximum(size - self.knee, 0.0) ** 2
        return self.strength * run.reducer.angle_rad * np.sign(load) * change


def draw(rng, reducer):
    """Segments, cubic hardening, or softening."""
    return HardeningStiffness(0.0, str(rng.choice(LAWS)), rng.uniform(0.2, 0.5))
