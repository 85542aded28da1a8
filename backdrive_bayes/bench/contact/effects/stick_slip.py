"""A brittle contact at a seal: it holds, breaks, and holds again a little further on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.drawing import log_uniform
from backdrive_bayes.bench.contact.effect import ContactEffect


@dataclass(frozen=True)
class StickSlip(ContactEffect):
    """Friction that falls from its static to its kinetic level by strength (share of T_r) each time it breaks.

    It builds up again over ``spacing``, a share of that shaft's turn, on the seal of the ``body``-th shaft; ``kinetic`` is the
    kinetic level over that fall.
    """

    spacing: float
    kinetic: float
    body: int

    most = 0.3

    def chain(self, test, chain):
        """Chain with the brittle contact."""
        reducer, fall = test.reducer, self.strength
        spacing = self.spacing * (reducer.floating_angles(1.0)[self.body] + reducer.deflections()[self.body :].sum())
        return chain._replace(stick=np.array([self.body, fall * (1.0 + self.kinetic), fall * self.kinetic, fall / spacing]))


def draw(rng, reducer):
    """On the output shaft, or on the next."""
    return StickSlip(0.0, log_uniform(rng, 0.008, 0.05), rng.uniform(0.0, 0.6), int(rng.integers(min(2, reducer.stages))))
