"""A zero error of the torque sensor, or a dead weight on the flange: more torque acts than is commanded."""

from __future__ import annotations

from dataclasses import dataclass

from backdrive_bayes.bench.contact.effect import ContactEffect, sign


@dataclass(frozen=True)
class TorqueOffset(ContactEffect):
    """Acting torque beside the commanded one, strength in shares of T_r; ``retared`` scatters it from record to record."""

    direction: float
    retared: tuple[float, ...]

    most = 0.3
    of_reducer = False

    def load(self, test, time_s, load):
        """Offset torque."""
        return load + self.direction * self.strength * (1.0 + self.retared[test.where.index % len(self.retared)])


def draw(rng, reducer):
    """Either sign; the same in all records, or zeroed anew before each."""
    scatter = 0.3 * float(rng.integers(2))
    return TorqueOffset(0.0, sign(rng), tuple((scatter * rng.uniform(-1, 1, 8)).tolist()))
