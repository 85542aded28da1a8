"""Jitter of the crossing torques: how far, and over which torque, clearances cross elsewhere each time."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import whiten
from backdrive_bayes.engine.reduced import Jitter

USUAL_JITTER = Jitter(0.15, 0.002)
"""Of the bench's torque noise, and of the torque scale."""
JITTER_LOG_SD = 1.5
"""Standard deviation of the log jitter about its usual size."""
JITTERS = tuple(Jitter(size, length) for size in (0.15, 0.5, 1.5, 5.0, 15.0, 45.0) for length in (0.002, 0.01, 0.05))
"""Sizes and lengths that are tried."""


def learn_jitter(linear: Linear) -> Jitter:
    """The jitter with the highest marginal likelihood times its prior, other things as they are: uphill from the present one."""
    reduced, scale = linear.reduced, np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    noise, slopes, columns = reduced.context.torque_noise, reduced.slopes(linear.predicted), linear.design.records()

    def height(jitter):
        size = Jitter(jitter.torque * noise, jitter.length)
        data = whiten(columns, linear.angles, reduced.covariances(slopes, size), reduced.scale_dof, reduced.settled)
        prior = -0.5 * (np.log(jitter.torque / USUAL_JITTER.torque) / JITTER_LOG_SD) ** 2
        return data.log_marginal(scale) + data.log_volume + prior

    present = np.log([linear.jitter.torque / noise, linear.jitter.length])
    best = min(JITTERS, key=lambda j: float(np.abs(np.log([j.torque, j.length]) - present).sum()))
    known = {best: height(best)}
    while True:
        for other in _neighbours(best):
            known.setdefault(other, height(other) if other not in known else 0.0)
        better = max(known, key=lambda size: known[size])
        if better == best:
            return Jitter(best.torque * noise, best.length)
        best = better


def _neighbours(jitter):
    sizes, lengths = sorted({j.torque for j in JITTERS}), sorted({j.length for j in JITTERS})
    i, j = sizes.index(jitter.torque), lengths.index(jitter.length)
    near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
    return [Jitter(sizes[a], lengths[b]) for a, b in near if 0 <= a < len(sizes) and 0 <= b < len(lengths)]
