"""Knots of clearance and free play: where blocks are at first, and more where residuals want them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.design import histories
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.reduced import Reduced
from backdrive_bayes.mechanics.clearance import place_knots, spaced
from backdrive_bayes.mechanics.effect import Distortion
from backdrive_bayes.mechanics.part import TOP
from backdrive_bayes.mechanics.reducer import ReducerClass

KNOTS, MOST_KNOTS = 60, 140
"""Knots of clearance and free play at first, and refined."""
LEAST_APART = 0.3
"""Least distance of knots in the torque noise of a sample."""
CONSPICUOUS = 3.5
"""Whitened residual beyond which the knots near a block are refined."""


def first_knots(reduced: Reduced, distortion: Distortion) -> np.ndarray:
    """Knots where the settled blocks are."""
    torques = []
    for r, (history, settled) in enumerate(zip(histories(reduced, distortion), reduced.settled, strict=True)):
        middle = history.mean(history.z0[:, None], history.z1[:, None])[:, 0]
        torques.append(_felt(middle, reduced, distortion, r)[settled])
    return place_knots(np.concatenate(torques), KNOTS, LEAST_APART * reduced.context.torque_noise)


def least_distance(reduced: Reduced) -> float:
    """Least distance of knots in a refined class, in shares of the torque scale."""
    return 0.8 * LEAST_APART * reduced.context.torque_noise


def finer(linear: Linear) -> ReducerClass:
    """The class with more knots where settled blocks leave a conspicuous residual, the worst first until there are MOST_KNOTS."""
    reduced, knots, wanted = linear.reduced, linear.reducer.knots, []
    for r, (white, settled) in enumerate(zip(linear.residuals(), reduced.settled, strict=True)):
        begin, end = _felt(reduced.blocks[r].edges_nm() / reduced.torque_scale_nm, reduced, linear.distortion, r)
        for i in np.flatnonzero((np.abs(white) > CONSPICUOUS) & settled).tolist():
            about = range(max(i - 1, 0), min(i + 2, white.size))
            wanted.append((abs(white[i]), np.concatenate([np.linspace(begin[j], end[j], 5) for j in about])))
    wanted.sort(key=lambda found: -found[0])
    for _, torques in wanted:
        inner = np.unique(np.r_[knots[:-1], np.abs(torques)])
        more = spaced(np.r_[inner[inner < TOP], TOP], least_distance(reduced))
        knots = more if more.size <= MOST_KNOTS else knots
    return replace(linear.reducer, knots=knots)


def _felt(torque, reduced, distortion, record: int) -> np.ndarray:
    """Torques (…, blocks) of a record as clearances feel them: behind a drag at the shaft, over the growth of their own drag."""
    blocks, context = reduced.blocks[record], reduced.context
    log_amplitude = histories(reduced, distortion)[record].log_amplitude
    _, growth, drag = distortion.growth(context.log_rate[record], log_amplitude, context)
    return (torque - drag * blocks.direction[blocks.leg]) * np.exp(-growth)
