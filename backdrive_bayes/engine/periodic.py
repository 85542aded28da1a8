"""Encoder error: a wave in the angle whose period is looked for, averaged over all periods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.linear import Linear

FREQUENCIES = np.arange(3.0, 50.0, 0.125)
"""Waves in one angle scale: fewer than six over the whole range cannot be told from smooth functions of the angle; the spacing
is a quarter of a wave over the range."""
WAVE, AMPLITUDE = "wave", 6e-3
"""Name of the wave's columns in a linear model, and a wave's usual amplitude in shares of the angle scale."""
PRICE = float(np.log(FREQUENCIES.size))
"""What a wave at one of these frequencies costs."""
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


def with_wave(linear: Linear, frequency: float) -> Linear:
    """The linear model with a wave of the angle's reading beside."""
    return linear.beside(replace(wave_group(linear, frequency), name=WAVE), AMPLITUDE)


def clearest_wave(linear: Linear) -> tuple[float, float]:
    """Gain in log marginal likelihood of the best wave beside what the linear model holds, less its price, and its frequency."""
    data = linear.whitened(Design((wave_group(linear, FREQUENCIES),)))
    scale = np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    seen = linear.solution.root.T @ (linear.data.x.T @ data.x)
    left = (data.moment - data.x.T @ (linear.data.x @ linear.solution.mean)).reshape(-1, 2)
    pairs, seen = data.x.T.reshape(-1, 2, data.y.size), seen.T.reshape(-1, 2, scale.size)
    gram = np.einsum("fin,fjn->fij", pairs, pairs) - np.einsum("fim,fjm->fij", seen, seen)
    inner = np.eye(2) + AMPLITUDE**2 * gram
    solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
    gains = 0.5 * AMPLITUDE**2 * np.sum(left * solved, axis=1) / linear.solution.variance - 0.5 * np.linalg.slogdet(inner)[1]
    at = int(np.argmax(gains))
    return float(gains[at]) - PRICE, float(FREQUENCIES[at])
