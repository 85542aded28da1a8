"""Encoder error: a wave in the angle whose period is looked for, averaged over all periods."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import Group
from backdrive_bayes.engine.linearise import Linear

FREQUENCIES = np.arange(3.0, 50.0, 0.125)
"""Waves in one angle scale: fewer than six over the whole range cannot be told from smooth functions of the angle; the spacing
is a quarter of a wave over the range."""
NODES = 12
"""Points within a block at which a wave is followed."""


def wave_group(linear: Linear, frequency: float | np.ndarray) -> Group:
    """Sine and cosine of the read angle at one frequency (or several, side by side)."""
    columns = []
    share = (np.arange(NODES) + 0.5) / NODES
    for blocks, angle in zip(linear.reduced.blocks, linear.predicted, strict=True):
        time = blocks.begin_s[:, None] + (blocks.end_s - blocks.begin_s)[:, None] * share
        phase = 2 * np.pi * np.interp(time, blocks.mid_s, angle)[:, :, None] * np.atleast_1d(frequency)
        waves = np.stack([np.sin(phase).mean(axis=1), np.cos(phase).mean(axis=1)], axis=-1)
        columns.append(waves.reshape(blocks.count.size, -1))
    return Group("encoder_error", tuple(columns))
