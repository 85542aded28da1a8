"""Effects of the friction: in jumps, following the rate, and growing with the load."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.bench.draws import log_uniform, sign
from backdrive_bayes.bench.sliders.effect import Effect
from backdrive_bayes.bench.sliders.reducer import slider_levels


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


def draw_stick_slip(rng, reducer):
    """Everywhere, under load only, or fading as the rate rises."""
    uneven = rng.uniform(0.05, 0.35)
    excesses = 1.0 + uneven * rng.uniform(-1, 1, 97)
    variant = str(rng.choice(["everywhere", "loaded", "slow"]))
    return StickSlip(0.0, variant, uneven, rng.uniform(0.0, 0.3), tuple(excesses.tolist()))


@dataclass(frozen=True)
class RateDependentFriction(Effect):
    """Friction levels times a factor of the rate: logarithmic, power law or Stribeck; strength is its change per decade.

    ``with_drag`` lets the drag in the clearance change too. Source: Stribeck, VDI-Zeitschrift 46, 1902.
    """

    law: str
    direction: float
    reference: float
    with_drag: bool

    guess = 0.2
    most = 4.0

    def friction(self, run, torque_nm, half_width_nm):
        """Slider friction at this rate [N·m]."""
        return half_width_nm * self._factor(run)

    def floating_drag(self, run, drag_nm):
        """Drag at this rate [N·m]."""
        return drag_nm * self._factor(run) if self.with_drag else drag_nm

    def _factor(self, run):
        decades = np.log10(run.relative_rate / self.reference)
        if self.law == "power":
            return float(np.clip(10.0 ** (0.45 * self.direction * self.strength * decades), 0.05, 8.0))
        if self.law == "stribeck":
            decades = 1.0 - 2.0 / (1.0 + run.relative_rate / self.reference)
        return float(np.clip(1.0 + self.direction * self.strength * decades, 0.05, 8.0))


def draw_rate_dependent_friction(rng, reducer):
    """Three laws, both signs."""
    law = str(rng.choice(["log", "power", "stribeck"]))
    return RateDependentFriction(0.0, law, sign(rng), log_uniform(rng, 0.15, 0.6), bool(rng.integers(2)))


@dataclass(frozen=True)
class LoadDependentFriction(Effect):
    """Each slider holds back more in proportion to the load beyond ``onset``; strength is the mean ratio."""

    spread: float
    onset: float

    guess = 0.03
    most = 0.6

    def friction(self, run, torque_nm, half_width_nm):
        """Slider friction with the load's part [N·m]."""
        load = np.maximum(np.abs(torque_nm) - self.onset * run.reducer.rated_torque_nm, 0.0)
        return half_width_nm + self.strength * load[:, None] * slider_levels(self.spread)[1]


def draw_load_dependent_friction(rng, reducer):
    """Equal or spread ratios, from no load on or from a preload on."""
    return LoadDependentFriction(0.0, rng.uniform(0.02, 0.7), float(rng.choice([0.0, rng.uniform(0.05, 0.2)])))
