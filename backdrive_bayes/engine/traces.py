"""How large an effect may be on this unit where it is a mere trace, and how large it usually is where it acts.

All traces are measured alike: by how far they move the angle, against the noise of a sample (those of teeth against its white
part). No bench is free of them.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.special import erf

from backdrive_bayes.engine.design import Design
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.mechanics.effect import Context, Effect
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS

OFFSET = "torque_offset"
"""Its columns are the slope of the loop."""
TRACE = 0.1
"""Root mean square by which a trace of an effect moves the angle, in standard deviations of a sample's noise."""
ABOVE = 10.0
"""An effect that acts is usually as many times a trace, or it could not be told from one."""


def trace_levels(reduced: Reduced, design: Design, effects: Iterable[Effect]) -> dict[str, float]:
    """Standard deviations of effects' weights at trace level by name, no more than where they act; what has no columns in the
    design leaves no trace and is not there."""
    found, noises = {}, sample_noise(reduced, design)
    for effect in (e for e in effects if e.name in design.names):
        group, square, count, present = design.group(effect.name), 0.0, 0, effect.present(reduced.context)
        for record, (settled, noise) in enumerate(zip(reduced.settled, noises, strict=True)):
            columns, own = group.of_record(record)[settled], noise[settled]
            columns = columns - np.average(columns, axis=0, weights=own**-2.0)
            square += float(np.sum((columns / own[:, None]) ** 2))
            count += int(settled.sum())
        found[effect.name] = present if effect is BENCH_HYSTERESIS else TRACE / max(np.sqrt(square / count), TRACE / present)
    return found


def trace_probabilities(sizes, ratio: float, level: float) -> np.ndarray:
    """Probabilities that a trace in the samples, of a root mean square that is half-normal with ``level``, is below all ``sizes``
    (n,), which are ``ratio`` apart, and that it is about each of them, (1 + n,)."""
    below = erf(sizes / np.sqrt(ratio) / max(level, np.finfo(float).tiny) / np.sqrt(2.0))
    return np.diff(np.r_[0.0, below, 1.0])


def wave_trace(linear: Linear) -> float:
    """Standard deviation of a wave's sine and cosine at trace level, in shares of the angle scale."""
    each = zip(sample_noise(linear.reduced, linear.design), linear.reduced.settled, strict=True)
    inverse = np.concatenate([noise[own] ** -2.0 for noise, own in each])
    return float(TRACE / np.sqrt(inverse.mean()))


def sample_noise(reduced: Reduced, design: Design) -> list[np.ndarray]:
    """Standard deviation of a single sample's noise, of the angle and of the torque, at each block in shares of the angle scale,
    (blocks,) by record; the torque's acts by the slope of the loop, which is what an offset of the torque moves."""
    found = []
    for record, noise in enumerate(reduced.noise):
        if OFFSET in design.names:
            moved = np.abs(design.group(OFFSET).columns[record][:, 0]) * noise.torque_nm / reduced.torque_scale_nm
        else:
            moved = reduced.read_slopes[record] * noise.torque_nm / reduced.angle_scale_rad
        found.append(np.hypot(moved, np.hypot(noise.white_rad, noise.correlated_rad) / reduced.angle_scale_rad))
    return found


def usual_level(effect: Effect, context: Context, trace: float) -> float:
    """Usual standard deviation of an effect's weights where it acts: its own, or ABOVE times its trace if that is more and it is
    not known."""
    return effect.present(context) if effect.known else max(effect.present(context), ABOVE * trace)
