"""A loose key or spline between the reducer's shaft and the measured flange, held by a drag of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import ContactEffect
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


def draw(rng, reducer):
    """Drags of three to eight times the bearings', at least a tenth of the rated torque; one to four flanks."""
    drag = float(np.clip(reducer.drag * rng.uniform(3.0, 8.0), rng.uniform(0.1, 0.25), 0.5))
    return SecondBacklash(
        0.0, drag, drag * rng.uniform(0.05, 0.4), int(rng.integers(1, 5)), rng.uniform(0.0, 0.2), rng.uniform(1.0, 1.5),
        rng.uniform(0.02, 0.15),
    )  # fmt: skip
