"""Likelihood of a sawtooth in noise: what stick-slip leaves of a smooth curve.

A contact that sticks holds its part of the angle back, in proportion to the torque run since it last broke loose; then it leaps
ahead to where it belongs (Armstrong-Hélouvry et al., Automatica 30, 1994, section 3). The teeth come at about even torques. The
run since the last leap is the hidden state of a renewal process, filtered exactly; the noise is an autoregression.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtr

SPREAD = 0.25
"""Standard deviation of the logarithm of a tooth's length."""
STRAY = 1e-3
"""Share of instants at which something else moves the angle either way, by up to ``FAR`` noise standard deviations."""
FAR = 6.0
APART = 64
"""Room between the rows of an array that compiled loops go through at once: more than they take in a stride (32 numbers)."""


@dataclass(frozen=True, eq=False)
class Series:
    """Residuals ``value`` at even times, signed by the direction of motion; ``fresh`` where a run of samples begins."""

    value: np.ndarray
    fresh: np.ndarray

    def halved(self) -> Series:
        """Means of pairs."""
        values, fresh = [], []
        for run in np.split(self.value, np.flatnonzero(self.fresh)[1:]):
            pairs = run[: run.size // 2 * 2].reshape(-1, 2).mean(axis=1)
            values.append(pairs)
            fresh.append(np.arange(pairs.size) == 0)
        return Series(np.concatenate(values), np.concatenate(fresh))


@dataclass(frozen=True)
class Noise:
    """Autoregression of first order, the spread of the values, and its log likelihood without teeth."""

    memory: float
    innovation: float
    scale: float
    log_likelihood: float


def fit_noise(series: Series) -> Noise:
    """The most likely autoregression."""
    scale = max(1.4826 * float(np.median(np.abs(series.value))), 1e-300)
    value = series.value / scale

    def cost(x):
        return -_smooth(value, series.fresh, np.tanh(x[0]), np.exp(x[1]))

    found = minimize(cost, [1.0, -0.5], method="Nelder-Mead", options={"xatol": 0.02, "fatol": 0.02, "maxiter": 80})
    return Noise(float(np.tanh(found.x[0])), float(np.exp(found.x[1])), scale, -float(found.fun))


def tooth_gain(series: Series, noise: Noise, memory: float, height: float, length: float) -> float:
    """Log likelihood of teeth over noise alone.

    ``height`` in spreads of the values, ``length`` in samples; a negative height makes the angle creep ahead and leap back.
    """
    value = np.copysign(1.0, height) * series.value / noise.scale
    return _toothed(value, series.fresh, memory, noise.innovation, abs(height), length, _holds(length)) - noise.log_likelihood


def _holds(length: float) -> np.ndarray:
    """Probability that a tooth that has lasted k samples lasts one more, log-normal in its length."""
    longest = int(np.ceil(length * np.exp(3 * SPREAD))) + 1
    left = ndtr(-np.log(np.maximum(np.arange(longest + 1), 0.5) / length) / SPREAD)
    holds = left[1:] / left[:-1]
    holds[-1] = 0.0
    return holds


@numba.njit(cache=True, fastmath=True)
def _smooth(value, fresh, memory, sd):
    found, stray = 0.0, STRAY / FAR
    for t in range(1, value.size):
        if not fresh[t]:
            left = (value[t] - memory * value[t - 1]) / sd
            found += np.log((1.0 - STRAY) * np.exp(-0.5 * left * left) / sd + stray)
    return found


@numba.njit(cache=True, fastmath=True, inline="always")
def _bell(start, step, out):
    """exp(-(start + step k)² / 2) for every k, by products outward from the largest."""
    top = 0
    if step != 0.0:
        top = int(min(max(np.rint(-start / step), 0.0), out.size - 1.0))
    x, fall = start + step * top, np.exp(-step * step)
    out[top] = np.exp(-0.5 * x * x)
    # One exponential: of the largest on, none of its factors exceeds one.
    value, factor = out[top], np.exp(-(x + 0.5 * step) * step)
    for k in range(top + 1, out.size):
        value *= factor
        factor *= fall
        out[k] = value
    value, factor = out[top], np.exp((x - 0.5 * step) * step)
    for k in range(top - 1, -1, -1):
        value *= factor
        factor *= fall
        out[k] = value


@numba.njit(cache=True, fastmath=True)
def _toothed(value, fresh, memory, sd, height, length, given):
    # Rows of one array: how near to one another arrays of their own happen to lie decides in which order loops add.
    rows, size = np.zeros((6, given.size + APART)), given.size
    first, now, then = rows[0, :size], rows[1, :size], rows[2, :size]
    on, back, holds = rows[3, :size], rows[4, :size], rows[5, :size]
    holds[:], first[0], runs = given, 1.0, 1.0
    for k in range(1, size):
        first[k] = first[k - 1] * holds[k - 1]
        runs += first[k]
    now[:] = first / runs
    found, known, stray, fall = 0.0, (1.0 - STRAY) / sd, STRAY / FAR, height / length
    for t in range(1, value.size):
        if fresh[t]:
            for k in range(holds.size):
                now[k] = first[k] / runs
            continue
        # The tooth's value is height / 2 - fall k; it goes on to k + 1, or leaps to k = 0.
        top = (value[t] - memory * value[t - 1] - 0.5 * height * (1.0 - memory)) / sd
        _bell(top + fall / sd, fall * (1.0 - memory) / sd, on)
        _bell(top, -memory * fall / sd, back)
        total, leaps = 0.0, 0.0
        for k in range(holds.size - 1):
            then[k + 1] = now[k] * holds[k] * (known * on[k] + stray)
            total += then[k + 1]
        for k in range(holds.size):
            leaps += now[k] * (1.0 - holds[k]) * (known * back[k] + stray)
        then[0] = leaps
        total += leaps
        found += np.log(total)
        for k in range(holds.size):
            now[k] = then[k] / total
    return found
