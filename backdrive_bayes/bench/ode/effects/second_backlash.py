"""A second clearance on the output side, with a drag of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.ode.chain import coupling
from backdrive_bayes.bench.ode.contact import Mesh, compliance_table
from backdrive_bayes.bench.ode.effect import OdeEffect
from backdrive_bayes.bench.ode.integrate import follow


@dataclass(frozen=True)
class SecondBacklash(OdeEffect):
    """A coupling that rubs along its clearance with ``drag`` (share of T_r); strength is the clearance in angle scales.

    ``engagement`` is the torque of its centring spring, ``power`` and ``spread`` the contact at its ends, ``rounding`` the
    bristles' travel over half the clearance.
    """

    drag: float = 0.3
    engagement: float = 0.02
    power: float = 1.5
    spread: float = 0.3
    rounding: float = 0.05

    def series(self, run, time_s, torque):
        """Travel of the coupling; all of it scales with the clearance."""
        table = compliance_table(Mesh(1.0, self.engagement, 0.1, self.power, self.spread, 4))
        chain = coupling(*table, self.drag, self.rounding)
        time, travel = follow(chain, time_s, torque, np.zeros_like(torque), np.ones_like(torque), run.where.floating)
        return time, 0.5 * self.strength * travel


def draw(rng, reducer):
    """A step well above the first drag, where settled loops still cross it."""
    drag = rng.uniform(max(0.12, min(3.0 * (reducer.drag + reducer.engagement), 0.45)), 0.55)
    return SecondBacklash(
        0.0, drag, drag * log_uniform(rng, 0.03, 0.25), rng.uniform(1.0, 1.6), rng.uniform(0.0, 0.6), log_uniform(rng, 0.01, 0.2)
    )
