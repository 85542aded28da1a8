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
_PROBE = 0.1
_FAR = 0.2
"""Small effects are linear in strength, so that one evaluation tells it; one more where that is far below the first."""


@dataclass(frozen=True, eq=False)
class Trace:
    """A trace of an effect, with its height as far as the angle is linear in its strength."""

    name: str
    effect: BenchEffect
    height: float


def draw_soil(rng, yardstick: Yardstick, level: float, planted=()) -> tuple[Trace, ...]:
    """A trace of every channel effect of the bench that is not ``planted``; ``level`` 1 is a usual bench, 0 a clean one."""
    names = [name for name in TRACES if name in yardstick.mechanics.effects and name not in planted]
    return tuple(_trace(rng, name, yardstick, level) for name in names) if level > 0.0 else ()


def _trace(rng, name, yardstick, level):
    effect = yardstick.mechanics.effects[name](rng, yardstick.reducer)
    wanted, strength, height = level * rng.uniform(*HEIGHT), _PROBE * min(effect.guess, effect.most), 0.0
    for _ in range(2):
        change = yardstick.change((replace(effect, strength=strength),))
        height, whole = height_of(yardstick.beyond(change)), height_of(_without_means(change, len(yardstick.records)))
        if whole == 0.0:
            return Trace(name, replace(effect, strength=0.0), 0.0)
        times = min(wanted / max(height, 1e-12), level * ABSORBED / whole, effect.most / strength)
        strength, height = float(times * strength), float(times * height)
        if times > _FAR:
            break
    return Trace(name, replace(effect, strength=strength), height)


def _without_means(change, records):
    rows = change.reshape(records, -1)
    return rows - np.mean(rows, axis=1, keepdims=True)
