"""Static friction above kinetic friction: junctions that age at rest and break over a short slip, in small jumps.

Source: Dieterich, J. Geophys. Res. 84, 1979 (ageing), and Armstrong-Hélouvry et al., Automatica 30, 1994, section 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np

from backdrive_bayes.bench.draws import log_uniform
from backdrive_bayes.bench.ode.effect import OdeEffect

STEP = 0.04
"""Torque step over the excess."""
MOST_STEPS = 40000
BEND = 0.05
"""Travel over which bristles bend, over that of a jump."""


@dataclass(frozen=True)
class StickSlip(OdeEffect):
    """A spring of ``compliance`` (angle scales at T_r) in series that rubs; strength is the static excess over T_r.

    Junctions heal in ``healing_s`` and break over the share ``brittle`` of a jump, all but ``kinetic`` of them; ``uneven``
    scatters the excess along the way; where ``loaded``, it needs load.
    """

    compliance: float = 0.5
    healing_s: float = 0.01
    brittle: float = 0.2
    kinetic: float = 0.1
    uneven: float = 0.2
    loaded: bool = False

    most = 0.3

    def series(self, run, time_s, torque):
        """What the jumps leave of the spring's travel."""
        travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(torque)))])
        steps = min(int(np.ceil(travelled[-1] / (STEP * self.strength))), MOST_STEPS)
        time = np.unique(np.concatenate([time_s, np.interp(np.linspace(0.0, travelled[-1], steps + 1), travelled, time_s)]))
        load = np.interp(time, time_s, torque)
        room = np.clip(1.5 * np.abs(load), 0.05, 1.0) if self.loaded else np.ones_like(load)
        held = _held(time, load / self.strength, room, self.healing_s, self.brittle, self.kinetic, self.uneven)
        return time, -self.strength * self.compliance * held


@numba.njit(cache=True)
def _held(time, pull, room, healing, brittle, kinetic, uneven):
    """Torque that the junctions hold, over the static excess, shape (steps,)."""
    held, place, age, bristle = np.zeros(time.size), pull[0], 1.0, 0.0
    for k in range(1, time.size):
        age = 1.0 - (1.0 - age) * math.exp(-(time[k] - time[k - 1]) / healing)
        rough = room[k] * (1.0 + uneven * 0.5 * (math.sin(2.7 * place) + math.sin(7.3 * place + 1.0)))
        side = 1.0 if pull[k] - place - rough * (kinetic + (1.0 - kinetic) * age) * bristle > 0.0 else -1.0
        moved = _first_rest(pull[k] - place, side, age, bristle, rough, brittle, kinetic)
        bristle = side - (side - bristle) * math.exp(-moved / BEND)
        age *= math.exp(-moved / brittle)
        place += side * moved
        held[k] = pull[k] - place
    return held


@numba.njit(cache=True)
def _excess(moved, pull, side, age, bristle, rough, brittle, kinetic):
    """Driving less holding torque after a slip, in the direction of the slip."""
    strength = rough * (kinetic + (1.0 - kinetic) * age * math.exp(-moved / brittle))
    return side * pull - moved - strength * (1.0 - (1.0 - side * bristle) * math.exp(-moved / BEND))


@numba.njit(cache=True)
def _first_rest(pull, side, age, bristle, rough, brittle, kinetic):
    """Shortest slip after which the torque is held again."""
    low, high = 0.0, 1e-4
    while _excess(high, pull, side, age, bristle, rough, brittle, kinetic) > 0.0:
        low, high = high, high * 1.25
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _excess(middle, pull, side, age, bristle, rough, brittle, kinetic) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def draw(rng, reducer):
    """Everywhere, under load only, or fading as the rate rises."""
    variant = rng.integers(3)
    healing = log_uniform(rng, 0.05, 0.4) if variant == 2 else log_uniform(rng, 0.001, 0.01)
    return StickSlip(
        0.0,
        rng.uniform(0.3, 0.7),
        healing,
        rng.uniform(0.08, 0.3),
        rng.uniform(0.0, 0.3),
        rng.uniform(0.05, 0.35),
        bool(variant == 1),
    )
