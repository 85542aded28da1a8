"""Encoder error: a wave in the angle whose period is looked for, averaged over all periods."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from backdrive_bayes.engine.design import Design, Group
from backdrive_bayes.engine.linear import Linear

FREQUENCIES = np.arange(0.75, 50.0, 0.125)
"""Waves in one angle scale, from one and a half over the whole range, or nothing repeats; the spacing is a quarter of a wave over
the range."""
WAVE, AMPLITUDE = "wave", 6e-3
"""Name of the wave's columns in a linear model, and a wave's usual amplitude in shares of the angle scale."""
MOST_PHASES = 5
"""Records up to which each may have a phase of its own: the search of more would take minutes."""
SAME_ZERO = 0.1
"""Middles of loops, in angle scales, that lie closer are read from one zero: drift moves them as far."""
HARMONICS = 5
"""An interpolation error has harmonics: distorted quadrature signals give the second, flattened ones the third and fourth
(Heydemann, Appl. Opt. 20, 1981), a skewed shape leaves a fifth; eight were no better. The k-th is usually 1/k² of the first."""
FINE = 9
"""Frequencies about the best one that are tried in turn."""
NODES = 12
"""Points within a block at which a wave is followed."""


def log_prior(frequency):
    """Log probability of one of FREQUENCIES: of what order a period is, is not known (uniform in its logarithm)."""
    return -np.log(frequency) - np.log(np.sum(1.0 / FREQUENCIES))


def wave_group(linear: Linear, frequency: float | np.ndarray) -> Group:
    """Sine and cosine of the turned angle at one frequency (or several, side by side), each record's own where zeros differ."""
    columns, frequencies = [], np.atleast_1d(frequency)
    share = (np.arange(NODES) + 0.5) / NODES
    for blocks, angle in zip(linear.reduced.blocks, linear.turned, strict=True):
        time = blocks.begin_s[:, None] + (blocks.end_s - blocks.begin_s)[:, None] * share
        means = _mean_waves(2j * np.pi * np.interp(time, blocks.mid_s, angle), frequencies)
        columns.append(np.stack([means.imag, means.real], axis=-1).reshape(blocks.count.size, -1))
    return Group("encoder_error", tuple(columns), phases(linear) > 1)


def phases(linear: Linear) -> int:
    """Number of phases of a wave: one of the unit, or one of each record where their zeros differ, for an encoder that was
    zeroed anew, or counts anew, errs at other angles."""
    zeros = [0.5 * (a[s].min() + a[s].max()) for a, s in zip(linear.reduced.angles, linear.reduced.settled, strict=True)]
    return len(zeros) if np.ptp(zeros) > SAME_ZERO and len(zeros) <= MOST_PHASES else 1


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
    return replace(group, name=WAVE, columns=tuple(c / np.repeat(order**2, 2) for c in group.columns))


def rises(linear: Linear, frequency: float) -> bool:
    """Whether the reading rises with the angle everywhere beside the wave that the linear model holds."""
    order = np.repeat(np.arange(1, HARMONICS + 1), 2)
    return not turns_back((linear.weights[WAVE].reshape(-1, 2 * HARMONICS) / order**2).ravel(), frequency)


def turns_back(weights, frequency) -> np.ndarray:
    """Whether waves with ``weights`` (…, 2 HARMONICS phases) of sine and cosine at ``frequency`` (…,) and its multiples turn the
    reading back: no encoder does, such a wave draws the loop itself anew."""
    height = np.linalg.norm(np.reshape(weights, (*np.shape(weights)[:-1], -1, HARMONICS, 2)), axis=-1)
    steepest = (height @ np.arange(1, HARMONICS + 1)).max(axis=-1)
    return 2.0 * np.pi * np.asarray(frequency) * steepest >= 1.0


def with_wave(linear: Linear, frequency: float) -> Linear:
    """The linear model with a wave of the angle's reading and its harmonics beside."""
    return linear.beside(periodic_group(linear, frequency), AMPLITUDE)


@dataclass(frozen=True, eq=False)
class Bank:
    """Waves of several frequencies with their harmonics.

    ``members`` (members,) are the frequencies, ``waves`` those of all columns, two a frequency and phase. ``columns`` (members,
    2 HARMONICS phases) are the places of a member's columns, ``sizes`` their usual amplitudes, 0 where a harmonic is not there.
    """

    members: np.ndarray
    waves: np.ndarray
    columns: np.ndarray
    sizes: np.ndarray


@lru_cache
def coarse_bank(phases: int) -> Bank:
    """Waves of FREQUENCIES, with those harmonics that are among them."""
    return _bank(FREQUENCIES, FREQUENCIES, phases)


def fine_bank(frequency: float, phases: int) -> Bank:
    """Waves closely about one of FREQUENCIES, with all harmonics."""
    members = frequency + (FREQUENCIES[1] - FREQUENCIES[0]) * np.linspace(-0.5, 0.5, FINE)
    return _bank(members, np.sort((members[:, None] * np.arange(1, HARMONICS + 1)).ravel()), phases)


def _bank(members: np.ndarray, waves: np.ndarray, phases: int) -> Bank:
    """The bank of ``members`` among the sorted ``waves``."""
    order = np.arange(1, HARMONICS + 1)
    wanted = members[:, None] * order
    place = np.clip(np.searchsorted(waves, wanted - 1e-6), 0, waves.size - 1)
    inside = np.abs(waves[place] - wanted) < 1e-5
    columns = _places(place, waves.size, phases)
    return Bank(members, waves, columns, AMPLITUDE * np.tile(np.repeat(inside / order**2, 2, axis=1), phases))


def _places(place, waves: int, phases: int) -> np.ndarray:
    """Columns of the waves at ``place`` (members, harmonics), two a wave and phase, shape (members, 2 harmonics phases)."""
    columns = 2 * place[:, None, :, None] + np.arange(2) + 2 * waves * np.arange(phases)[:, None, None]
    return columns.reshape(len(place), -1)


def clearest_wave(linear: Linear) -> tuple[float, float]:
    """Gain in log marginal likelihood of the best wave beside what the linear model holds, with its log prior, and its
    frequency."""
    coarse = FREQUENCIES[np.argmax(_gains(linear, FREQUENCIES) + log_prior(FREQUENCIES))]
    members = fine_bank(coarse, phases(linear)).members
    gains = _gains(linear, members) + log_prior(members)
    at = int(np.argmax(gains))
    return float(gains[at]), float(members[at])


def _gains(linear, frequencies):
    """Gain in log marginal likelihood of each wave alone."""
    data = linear.whitened(Design((wave_group(linear, frequencies),)))
    seen = linear.solution.root.T @ (linear.data.x.T @ data.x)
    own = _places(np.arange(frequencies.size)[:, None], frequencies.size, phases(linear))
    left = (data.moment - data.x.T @ (linear.data.x @ linear.solution.mean))[own]
    waves, seen = data.x.T[own], seen.T[own]
    gram = np.einsum("fin,fjn->fij", waves, waves) - np.einsum("fim,fjm->fij", seen, seen)
    inner = np.eye(own.shape[1]) + AMPLITUDE**2 * gram
    solved = np.linalg.solve(inner, left[:, :, None])[:, :, 0]
    return 0.5 * AMPLITUDE**2 * np.sum(left * solved, axis=1) / linear.solution.variance - 0.5 * np.linalg.slogdet(inner)[1]
