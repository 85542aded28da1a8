"""Slow drift of the reading as the stand warms, or as the room's air does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.drawing import log_uniform
from backdrive_bayes.bench.contact.effect import ContactEffect, sign


@dataclass(frozen=True)
class ThermalDrift(ContactEffect):
    """Drift over the bench's time: ``law`` 'housing' warms behind its motor (two time constants, ``scale_s`` the slow one),
    'linear' goes on at one rate, 'room' follows a triangular wave of period ``scale_s``; strength is angle share, signed by
    ``direction``."""

    law: str
    direction: float
    scale_s: float
    ratio: float
    phase: float

    guess = 0.03
    most = 3.0
    of_reducer = False

    def read(self, test, time_s, angle):
        """Drifting reading."""
        t = (test.where.start_s + time_s) / self.scale_s
        if self.law == "linear":
            drift = t
        elif self.law == "room":
            drift = np.arcsin(0.97 * np.sin(2 * np.pi * t + self.phase)) / np.pi
        else:
            drift = 1.0 - (np.exp(-t) - self.ratio * np.exp(-t / self.ratio)) / (1.0 - self.ratio)
        return angle + self.direction * self.strength * drift


def draw(rng, reducer):
    """One to ten minutes, three laws."""
    law = str(rng.choice(["housing", "linear", "room"]))
    return ThermalDrift(0.0, law, sign(rng), log_uniform(rng, 50.0, 500.0), rng.uniform(0.05, 0.3), rng.uniform(0.0, 2 * np.pi))
