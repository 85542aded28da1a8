"""How large an effect may be on this unit where it is a mere trace, and how large it usually is where it acts.

All traces are measured alike: by how far they move the angle, against the noise of a sample. No bench is free of them.
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import Design
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.mechanics.effect import Effect
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS

OFFSET = "torque_offset"
"""Its columns are the slope of the loop."""
TRACE = 0.1
"""Root mean square by which a trace of an effect moves the angle, in standard deviations of a sample's noise."""
ABOVE = 10.0
"""An effect that acts is usually as many times a trace, or it could not be told from one."""


def trace_level(reduced: Reduced, design: Design, effect: Effect) -> float:
    """Standard deviation of an effect's weights at trace level, no more than where it acts."""
    present = effect.present(reduced.context)
    if effect is BENCH_HYSTERESIS:
        return present
    group, square, count = design.group(effect.name), 0.0, 0
    for record, (settled, noise) in enumerate(zip(reduced.settled, sample_noise(reduced, design), strict=True)):
        columns, noise = group.of_record(record)[settled], noise[settled]
        columns = columns - np.average(columns, axis=0, weights=noise**-2.0)
        square += float(np.sum((columns / noise[:, None]) ** 2))
        count += int(settled.sum())
    return TRACE / max(np.sqrt(square / count), TRACE / present)


def trace_of(linear: Linear, effect: Effect) -> float:
    """Trace level of an effect's weights in a linear model; what has no columns there leaves none."""
    return trace_level(linear.reduced, linear.design, effect) if effect.name in linear.design.names else 0.0


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


def usual_of(linear: Linear, effect: Effect) -> float:
    """Usual standard deviation of an effect's weights where it acts: its own, or ABOVE traces if that is more."""
    return max(effect.present(linear.reduced.context), ABOVE * trace_of(linear, effect))
