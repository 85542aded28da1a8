"""What no real bench is free of: traces of the channel effects, each far below one noise standard deviation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from backdrive_bayes.bench.protocol import BenchEffect
from backdrive_bayes.bench.severity import Yardstick, height_of

TRACES = (
    "sensor_lag",
    "thermal_drift",
    "torque_offset",
    "encoder_error",
    "asymmetric_stiffness",
    "viscoelastic_creep",
    "rate_dependent_friction",
)
HEIGHT = (0.02, 0.15)
"""Range of a trace's height (severity.py) at level 1, in noise standard deviations."""
ABSORBED = 0.5
"""Largest height of a trace before anything of it is absorbed."""
_PROBE, _ROUNDS, _NEAR = 0.1, 5, 0.25
"""Small effects are nearly linear in strength, so that two evaluations mostly do; a trace that has none so small is left out."""


@dataclass(frozen=True, eq=False)
class Trace:
    """A trace of an effect, with its height (severity.py)."""

    name: str
    effect: BenchEffect
    height: float


def draw_soil(rng, yardstick: Yardstick, level: float, planted=()) -> tuple[Trace, ...]:
    """A trace of every channel effect of the bench that is not ``planted``; ``level`` 1 is a usual bench, 0 a clean one."""
    names = [name for name in TRACES if name in yardstick.mechanics.effects and name not in planted]
    return tuple(_trace(rng, name, yardstick, level) for name in names) if level > 0.0 else ()


def _trace(rng, name, yardstick, level):
    effect = yardstick.mechanics.effects[name](rng, yardstick.reducer)
    wanted, strength = level * rng.uniform(*HEIGHT), _PROBE * min(effect.guess, effect.most)
    for _ in range(_ROUNDS):
        change = yardstick.change((replace(effect, strength=strength),))
        height, whole = height_of(yardstick.beyond(change)), height_of(_without_means(change, len(yardstick.records)))
        if whole == 0.0:
            break
        times = min(wanted / max(height, 1e-12), level * ABSORBED / whole, effect.most / strength)
        if abs(times - 1.0) < _NEAR:
            return Trace(name, replace(effect, strength=strength), height)
        strength = float(times * strength)
    return Trace(name, replace(effect, strength=0.0), 0.0)


def _without_means(change, records):
    rows = change.reshape(records, -1)
    return rows - np.mean(rows, axis=1, keepdims=True)
