"""Zero error of the torque sensor, or a dead weight on the shaft."""

from __future__ import annotations

from dataclasses import dataclass

from backdrive_bayes.bench.draws import sign
from backdrive_bayes.bench.sliders.effect import Effect


@dataclass(frozen=True)
class TorqueOffset(Effect):
    """The torque that acts is the measured one less an offset; strength is its share of rated torque.

    ``factors`` make it differ between records (a sensor zeroed anew); all 1 is a dead weight.
    """

    direction: float
    factors: tuple[float, ...]

    most = 0.25
    of_reducer = False

    def torque(self, run, torque_nm):
        """Acting torque [N·m]."""
        factor = self.factors[run.index % len(self.factors)]
        return torque_nm - self.strength * self.direction * factor * run.reducer.rated_torque_nm


def draw(rng, reducer):
    """The same in all records, or nearly."""
    spread = float(rng.choice([0.0, 0.0, 0.25]))
    return TorqueOffset(0.0, sign(rng), tuple((1.0 + spread * rng.uniform(-1, 1, 8)).tolist()))
