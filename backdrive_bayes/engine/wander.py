"""Slow wander of the angle's reading: noise whose correlation time is so long that it hides in the loop's own shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.covariance import channel_covariance
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import whiten_record
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.records.noise import NoiseEstimate

SIZES = tuple(2.0 ** np.arange(-4, 2))
"""Standard deviations that are tried, in that of the noise of a sample, about which wanders are usual (half-normal): what moves
the angle further is no noise."""
TIMES = tuple(0.5 ** np.arange(7, 0, -1))
"""Correlation times that are tried, in shares of a usual leg's duration."""
FIRST = (1, 3, 5)
"""Times at which a small one is tried first: where none of these helps there is no wander."""
PRICE = float(np.log(len(SIZES) * len(TIMES)))
"""What a wander of one of these sizes and times costs."""


def learn_wander(linear: Linear) -> tuple[Reduced, float]:
    """The unit with the wander of each record that has the highest marginal likelihood times its prior, other things as they are,
    and the gain in it less PRICE each; a record that gains no more has none.
    """
    noise, gained = list(linear.reduced.noise), 0.0
    rows = np.column_stack([linear.data.x, linear.data.y])
    inner = [part.T @ part for part in np.split(rows, np.cumsum([a.size for a in linear.angles])[:-1])]
    left = set(range(len(noise)))
    while left:
        # The record that gains most comes first, whatever their order.
        found = {r: _learn(linear, r, sum(inner) - inner[r]) for r in left}
        best = max(found, key=lambda r: found[r][1])
        own, gain, rows_of_it = found[best]
        if not gain > 0.0:
            break
        noise[best], inner[best], gained = own, rows_of_it, gained + gain
        left.remove(best)
    return replace(linear.reduced, noise=tuple(noise)), gained


def _learn(linear: Linear, record: int, rest) -> tuple[NoiseEstimate, float, np.ndarray]:
    """A record's noise with the best wander, its gain less PRICE, and the inner products of the record's rows under it; ``rest``
    are those of all others."""
    reduced, noise, blocks = linear.reduced, linear.reduced.noise[record], linear.reduced.blocks[record]
    scale = np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    columns = np.hstack([g.of_record(record) for g in linear.design.groups])
    still = linear.covariances[record] - channel_covariance(blocks, noise) / reduced.angle_scale_rad**2
    usual = float(np.hypot(noise.white_rad, noise.correlated_rad))
    leg = float(blocks.end_s[-1] - blocks.begin_s[0]) / blocks.direction.size
    tried: dict[tuple[int, int], tuple] = {}

    def height(at) -> float:
        if at not in tried:
            size = SIZES[at[0]] if at[0] >= 0 else 0.0
            own = replace(noise, wander_rad=size * usual, wander_time_s=TIMES[at[1]] * leg)
            covariance = still + channel_covariance(blocks, own) / reduced.angle_scale_rad**2
            white, volume = whiten_record(columns, linear.angles[record], covariance, reduced.settled[record])
            inner = white.T @ white
            log_marginal = float(replace(linear.data.moments, inner=rest + inner).log_marginal(scale)) + volume
            tried[at] = log_marginal - 0.5 * size**2, own, inner
        return tried[at][0]

    none = best = (-1, 0)
    while True:
        i, j = best
        near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)] if i >= 0 else [none, *((0, k) for k in FIRST)]
        better = max((at for at in (best, *near) if at[0] < len(SIZES) and 0 <= at[1] < len(TIMES)), key=height)
        if better == best:
            _, own, inner = tried[best]
            return own, height(best) - height(none) - PRICE if i >= 0 else 0.0, inner
        best = better
