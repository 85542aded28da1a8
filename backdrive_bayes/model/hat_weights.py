"""Weights on a fixed grid that carry a log-normal variable and keep its mean."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr


def hat_weights(nodes, mean, spread):
    """Mean-preserving weights on ``nodes`` of a log-normal variable of given mean and log-sd.

    ``nodes`` has shape (nodes,) and begins at 0; ``mean`` and ``spread`` have shape (…, 1). Returns shape (…, nodes), sums
    to 1. Each weight is the integral of a hat function over the density; mass beyond the last node goes to it.
    """
    z = np.full(np.broadcast_shapes(np.shape(mean), nodes.shape), -np.inf)
    with np.errstate(divide="ignore"):
        z[..., 1:] = (np.log(nodes[1:]) - np.log(mean)) / spread
    mass, moment = ndtr(z + 0.5 * spread), mean * ndtr(z - 0.5 * spread)
    gap = np.diff(nodes)
    d_mass, d_moment = np.diff(mass), np.diff(moment)
    rise = (d_moment - nodes[:-1] * d_mass) / gap
    weights = np.zeros_like(mass)
    weights[..., 1:] += rise
    weights[..., :-1] += d_mass - rise
    weights[..., -1] += 1 - mass[..., -1]
    return weights
