"""Slow wander of the angle's reading: noise whose correlation time is so long that it hides in the loop's own shape."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.covariance import channel_covariance
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import whiten_record
from backdrive_bayes.engine.reduced import Reduced

SIZES = tuple(2.0 ** np.arange(-4, 2))
"""Standard deviations that are tried, in that of the noise of a sample, about which wanders are usual (half-normal): what moves
the angle further is no noise."""
TIMES = tuple(0.5 ** np.arange(7, 0, -1))
"""Correlation times that are tried, in shares of a usual leg's duration."""
PRICE = float(np.log(len(SIZES) * len(TIMES)))
"""What a wander of one of these sizes and times costs."""


def learn_wander(linear: Linear) -> tuple[Reduced, float]:
    """The unit with the wander of each record that has the highest marginal likelihood, other things as they are, and the gain in
    it less PRICE each; a record whose likelihood does not rise by more has none.
    """
    reduced, noise, gained = linear.reduced, list(linear.reduced.noise), 0.0
    scale = np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    columns, data = linear.design.records(), linear.data
    ends = np.cumsum([0, *(a.size for a in linear.angles)])
    rows = [np.column_stack([data.x[a:z], data.y[a:z]]) for a, z in zip(ends[:-1], ends[1:], strict=True)]
    inner = [r.T @ r for r in rows]
    for r, blocks in enumerate(reduced.blocks):
        rest, settled = sum(inner) - inner[r], reduced.settled[r]
        still = linear.covariances[r] - channel_covariance(blocks, noise[r]) / reduced.angle_scale_rad**2
        plain = channel_covariance(blocks, noise[r])
        usual = float(np.hypot(noise[r].white_rad, noise[r].correlated_rad))
        leg = (blocks.end_s[-1] - blocks.begin_s[0]) / blocks.direction.size

        def height(i, j, r=r, blocks=blocks, rest=rest, settled=settled, still=still, usual=usual, leg=leg):
            size = SIZES[i] * usual if i >= 0 else 0.0
            own = replace(noise[r], wander_rad=size, wander_time_s=TIMES[j] * leg)
            covariance = still + channel_covariance(blocks, own) / reduced.angle_scale_rad**2
            white, volume = whiten_record(columns[r], linear.angles[r], covariance, settled)
            found = replace(data.moments, inner=rest + white.T @ white)
            usually = -0.5 * (size / usual) ** 2
            return float(found.log_marginal(scale)) + volume + usually, own, white

        best, now = (-1, 3), height(-1, 3)
        none, tried = now[0], {(-1, 3): now}
        while True:
            i, j = best
            near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)] if i >= 0 else [(0, k) for k in (1, 3, 5)]
            for at in near:
                if -1 <= at[0] < len(SIZES) and 0 <= at[1] < len(TIMES) and at not in tried:
                    tried[at] = height(*at)
            better = max(tried, key=lambda at: tried[at][0])
            if better == best:
                break
            best = better
        gain = tried[best][0] - none - PRICE
        if best[0] >= 0 and gain > 0.0:
            noise[r], white, gained = tried[best][1], tried[best][2], gained + gain
            inner[r] = white.T @ white
    return replace(reduced, noise=tuple(noise)), gained
