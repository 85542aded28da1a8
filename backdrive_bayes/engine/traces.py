"""How large an effect may be on this unit where it is a mere trace, and how large it usually is where it acts."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.mechanics.effect import GrowthEffect

HEIGHT = 0.15
"""Standard deviations of the noise by which a trace of a law of the rate may move the angle where it acts most."""
ABOVE = 10.0
"""An effect that acts is usually as many times a trace, or it could not be told from one."""


def trace_of(linear: Linear, effect) -> float:
    """Trace level of an effect's weights: its own; for an exponent or a bend of the rate's law what moves the angle by HEIGHT, if
    that is more."""
    own = effect.trace(linear.reduced.context)
    if not isinstance(effect, GrowthEffect) or effect.name not in linear.design.names:
        return own
    group = linear.design.groups[linear.design.names.index(effect.name)]
    heights = []
    for column, slope, noise in zip(group.columns, linear.reduced.slopes(linear.predicted), linear.reduced.noise, strict=True):
        sd = np.hypot(noise.correlated_rad, slope * noise.torque_nm) / linear.reduced.angle_scale_rad
        heights.append(column[:, 0] / sd)
    z = np.concatenate(heights)
    height = np.sqrt(np.sum(z**4) / max(np.sum(z**2), 1e-300))
    return float(max(own, HEIGHT / max(height, 1e-12)))


def usual_of(linear: Linear, effect) -> float:
    """Usual standard deviation of an effect's weights where it acts: its own, or ABOVE traces if that is more."""
    return max(effect.present(linear.reduced.context), ABOVE * trace_of(linear, effect))
