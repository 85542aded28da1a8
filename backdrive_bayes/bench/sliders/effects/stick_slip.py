"""Static friction above kinetic friction: the mesh sticks and lets go in small jumps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.sliders.effect import Effect

VARIANTS = ("everywhere", "loaded", "slow")


@dataclass(frozen=True)
class StickSlip(Effect):
    """The transmitted torque stays until it lags by the static excess, then jumps; strength is the excess over T_r.

    ``uneven`` scatters the excess from jump to jump, ``remaining`` is the share of it
    that a jump leaves. Source: Armstrong-Hélouvry et al., Automatica 30, 1994, section 3.
    """

    variant: str
    uneven: float
    remaining: float
    excesses: tuple[float, ...]

    most = 0.3

    def transmit(self, run, transmitted_nm):
        """Torque behind the sticking contact [N·m]."""
        excess = self.strength * run.reducer.rated_torque_nm * self._where(run)
        held, jumps, out = float(transmitted_nm[0]), 0, np.empty_like(transmitted_nm)
        for k, (wanted, most) in enumerate(zip(transmitted_nm.tolist(), excess.tolist(), strict=True)):
            lag = wanted - held
            stuck = most * self.excesses[jumps % len(self.excesses)]
            if abs(lag) > stuck:
                held, jumps = wanted - math.copysign(self.remaining * stuck, lag), jumps + 1
            out[k] = held
        return out

    def _where(self, run):
        if self.variant == "loaded":
            return np.clip(3.0 * np.abs(run.load) - 0.6, 0.0, 1.0)
        slow = 1.0 / (1.0 + run.relative_rate / 0.4) if self.variant == "slow" else 1.0
        return np.full(run.time_s.size, slow)


def draw(rng, reducer):
    """Everywhere, under load only, or fading as the rate rises."""
    uneven = rng.uniform(0.05, 0.35)
    excesses = 1.0 + uneven * rng.uniform(-1, 1, 97)
    return StickSlip(0.0, str(rng.choice(VARIANTS)), uneven, rng.uniform(0.0, 0.3), tuple(excesses.tolist()))
