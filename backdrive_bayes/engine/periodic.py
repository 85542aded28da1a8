"""Encoder error: a wave in the angle whose period is looked for, averaged over all periods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.linear import Linear

FREQUENCIES = np.arange(1.5, 50.0, 0.125)
"""Waves in one angle scale: fewer than three over the whole range are no period but a smooth function of the angle; the spacing
is a quarter of a wave over the range."""
WAVE, AMPLITUDE = "wave", 6e-3
"""Name of the wave's columns in a linear model, and a wave's usual amplitude in shares of the angle scale."""
PRICE = float(np.log(FREQUENCIES.size))
"""What a wave at one of these frequencies costs."""
HARMONICS = 3
"""An interpolation error has harmonics: distorted quadrature signals give the second, flattened ones the third and fourth
(Heydemann, Appl. Opt. 20, 1981). The k-th is usually 1/k of the first."""
FINE = 9
"""Frequencies about the best one that are tried in turn."""
NODES = 12
"""Points within a block at which a wave is followed."""


def wave_group(linear: Linear, frequency: float | np.ndarray) -> Group:
    """Sine and cosine of the read angle at one frequency (or several, side by side)."""
    columns, frequencies = [], np.atleast_1d(frequency)
    share = (np.arange(NODES) + 0.5) / NODES
    for blocks, angle in zip(linear.reduced.blocks, linear.predicted, strict=True):
        time = blocks.begin_s[:, None] + (blocks.end_s - blocks.begin_s)[:, None] * share
        means = _mean_waves(2j * np.pi * np.interp(time, blocks.mid_s, angle), frequencies)
        columns.append(np.stack([means.imag, means.real], axis=-1).reshape(blocks.count.size, -1))
    return Group("encoder_error", tuple(columns))


def _mean_waves(turn, frequencies) -> np.ndarray:
    """Means over nodes of exp(turn · frequency), (blocks, frequencies), for ``turn`` (blocks, nodes).

    From one to the next of even frequencies a product does for the exponential.
    """
    means = np.empty((turn.shape[0], frequencies.size), complex)
    steps = np.diff(frequencies, prepend=0.0)
    wave = ahead = np.exp(turn * steps[-1])
    for k, frequency in enumerate(frequencies):
        wave = wave * ahead if k and abs(steps[k] - steps[-1]) < 1e-12 else np.exp(turn * frequency)
        means[:, k] = wave.mean(axis=1)
    return means


def periodic_group(linear: Linear, frequency: float) -> Group:
    """A wave with its harmonics, each in proportion to its usual size."""
    order = np.arange(1, HARMONICS + 1)
    group = wave_group(linear, frequency * order)
    return Group(WAVE, tuple(c / np.repeat(order, 2) for c in group.columns))


def with_wave(linear: Linear, frequency: float) -> Linear:
    """The linear model with a wave of the angle's reading and its harmonics beside."""
    return linear.beside(periodic_group(linear, frequency), AMPLITUDE)


@dataclass(frozen=True, eq=False)
class Bank:
    """Waves of several frequencies with their harmonics.

    ``members`` (members,) are the frequencies, ``waves`` those of all columns, two a frequency. ``columns`` (members,
    2 HARMONICS) are the places of a member's columns, ``sizes`` their usual amplitudes (0 for a harmonic that is not there).
    """

    members: np.ndarray
    waves: np.ndarray
    columns: np.ndarray
    sizes: np.ndarray


def bank(members: np.ndarray, waves: np.ndarray) -> Bank:
    """The bank of ``members`` among the sorted ``waves``."""
    order = np.arange(1, HARMONICS + 1)
    wanted = members[:, None] * order
    place = np.clip(np.searchsorted(waves, wanted - 1e-6), 0, waves.size - 1)
    inside = np.abs(waves[place] - wanted) < 1e-5
    columns = 2 * place[:, :, None] + np.arange(2)
    return Bank(members, waves, columns.reshape(members.size, -1), AMPLITUDE * np.repeat(inside / order, 2, axis=1))


def fine_bank(frequency: float) -> Bank:
    """Waves closely about one of FREQUENCIES, with all harmonics."""
    members = frequency + (FREQUENCIES[1] - FREQUENCIES[0]) * np.linspace(-0.5, 0.5, FINE)
    return bank(members, np.sort((members[:, None] * np.arange(1, HARMONICS + 1)).ravel()))


COARSE = bank(FREQUENCIES, FREQUENCIES)


def clearest_wave(linear: Linear) -> tuple[float, float]:
    """Gain in log marginal likelihood of the best wave beside what the linear model holds, less its price, and its frequency."""
    coarse = FREQUENCIES[np.argmax(_gains(linear, FREQUENCIES))]
    members = fine_bank(coarse).members
    gains = _gains(linear, members)
    at = int(np.argmax(gains))
    return float(gains[at]) - PRICE, float(members[at])


def _gains(linear, frequencies):
    """Gain in log marginal likelihood of each wave alone."""
    data = linear.whitened(Design((wave_group(linear, frequencies),)))
    scale = np.exp([linear.log_scale[n] for n in linear.design.names])[linear.design.index]
    seen = linear.solution.root.T @ (linear.data.x.T @ data.x)
    left = (data.moment - data.x.T @ (linear.data.x @ linear.solution.mean)).reshape(-1, 2)
    pairs, seen = data.x.T.reshape(-1, 2, data.y.size), seen.T.reshape(-1, 2, scale.size)
    gram = np.einsum("fin,fjn->fij", pairs, pairs) - np.einsum("fim,fjm->fij", seen, seen)
    inner = np.eye(2) + AMPLITUDE**2 * gram
    solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
    return 0.5 * AMPLITUDE**2 * np.sum(left * solved, axis=1) / linear.solution.variance - 0.5 * np.linalg.slogdet(inner)[1]
