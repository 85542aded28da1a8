"""The angle channel answers late: a pure delay, one pole, or two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.contact.effect import ContactEffect
from backdrive_bayes.bench.contact.relaxation import relaxed_at


@dataclass(frozen=True)
class SensorLag(ContactEffect):
    """Reading behind the angle by strength, in seconds, on a steady slope; ``damping`` is that of the two-pole filter."""

    law: str
    damping: float

    of_reducer = False

    def late(self, test, run, time_s):
        """Lagging reading less the angle."""
        plain = np.interp(time_s, run.time_s, run.angle)
        if self.strength <= 0.0:
            return np.zeros_like(plain)
        if self.law == "delay":
            return np.interp(time_s - self.strength, run.time_s, run.angle) - plain
        if self.law == "one_pole":
            return relaxed_at(run.time_s, run.angle, self.strength, time_s).real - plain
        return self._two_poles(run, time_s) - plain

    def _two_poles(self, run, time_s):
        # Conjugate poles as one complex relaxation: y = Re(c z) with c such that the steady gain is 1 and the start is flat.
        root = self.damping + 1j * np.sqrt(1.0 - self.damping**2)
        pole = self.strength / (2.0 * self.damping * root)
        share = 1.0 + 1j * root.real / root.imag
        return (share * relaxed_at(run.time_s, run.angle, pole, time_s)).real


def draw(rng, reducer):
    """Three laws."""
    return SensorLag(0.0, str(rng.choice(["delay", "one_pole", "two_poles"])), rng.uniform(0.4, 0.9))
