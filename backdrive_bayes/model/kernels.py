"""Compiled inner loops of the model, all walkers in one call.

Hyperbolic tangents are most of the work in numpy; here they are a rational function and five doublings of the argument, exact
to some 1e-15, which compilers turn into vector instructions.
"""

from __future__ import annotations

import math

import numba
import numpy as np

OPTIONS = {"fastmath": {"contract"}, "error_model": "numpy"}
"""Fused multiply-add; no check for division by zero, which would keep loops from vector instructions."""


def _compiled(function):
    try:
        return numba.njit(cache=True, **OPTIONS)(function)
    except RuntimeError:  # nowhere to keep the compiled code
        return numba.njit(**OPTIONS)(function)


@numba.njit(inline="always", **OPTIONS)
def _saturated(x):
    """tanh(x) of a number."""
    x = min(max(x, -20.0), 20.0) * (1 / 32)
    square = x * x
    # Lambert's continued fraction, seven levels of it, over 135135.
    over = x * (1.0 + square * (17325 / 135135 + square * (378 / 135135 + square * (1 / 135135))))
    under = 1.0 + square * (62370 / 135135 + square * (3150 / 135135 + square * (28 / 135135)))
    # Written out, for a loop in here keeps those around it from vector instructions.
    over, under = 2.0 * over * under, over * over + under * under
    over, under = 2.0 * over * under, over * over + under * under
    over, under = 2.0 * over * under, over * over + under * under
    over, under = 2.0 * over * under, over * over + under * under
    over, under = 2.0 * over * under, over * over + under * under
    return over / under


@_compiled
def bent(torque, scale, straight, bend, out):
    """straight·τ + bend·tanh(τ/scale): ``torque`` and ``out`` (walkers, samples), the others (walkers,)."""
    for w in range(out.shape[0]):
        fine, slope, size = 1.0 / scale[w], straight[w], bend[w]
        for i in range(out.shape[1]):
            t = torque[w, i]
            out[w, i] = slope * t + size * _saturated(t * fine)


@_compiled
def _rising(torque, direction, step, out):
    """The rising boundary of a gap where ``direction`` is 1, the falling one, its mirror image, where it is -1."""
    shift = step[6]
    out[:] = 0.0
    for k in range(3):
        if step[k] != 0.0:
            share, drag, fine = direction * step[k], step[3 + k], step[7 + k]
            for i in range(out.size):
                out[i] += share * _saturated((direction * (torque[i] - shift) - drag) * fine)


@_compiled
def gap_positions(torque, leg_stop, leg_direction, leg_end, begin, steps, place, spread, out):
    """Positions from -1 to 1 in a gap whose boundaries are sums of three steps, along a path of monotone legs; into ``out``.

    ``torque`` (samples,); ``leg_stop``, ``leg_direction``, ``leg_end`` (legs,) as in ``Leg``; ``begin`` (1,) is the torque before
    the path. ``steps`` (walkers, 10): shares, torques and, last, inverse widths of the three steps, with the shift of the torque
    between. ``place`` from 0 to 1 and ``spread`` (walkers,): where between the boundaries the path begins, and
    which share of the gap lies at one or the other. ``out`` (walkers, samples).
    """
    low, high, end = np.empty(1), np.empty(1), np.empty(1)
    for w in range(out.shape[0]):
        step = steps[w]
        _rising(begin, 1.0, step, low)
        _rising(begin, -1.0, step, high)
        below, above = low[0], high[0]
        middle, between = below + place[w] * (above - below), spread[w]
        first = 0
        for k in range(leg_stop.size):
            direction, part = leg_direction[k], out[w, first : leg_stop[k]]
            _rising(torque[first : leg_stop[k]], direction, step, part)
            _rising(leg_end[k : k + 1], direction, step, end)
            # Mirrored, a falling leg rises.
            a, b, c = direction * middle, direction * below, direction * above
            for i in range(part.size):
                bound = direction * part[i]
                one, two, three = max(bound, a), max(bound, b), max(bound, c)
                part[i] = direction * (one + between * (two + place[w] * (three - two) - one))
            last = direction * end[0]
            middle, below, above = direction * max(last, a), direction * max(last, b), direction * max(last, c)
            first = leg_stop[k]


@_compiled
def relaxed(signal, step, constant, start, out):
    """First-order relaxation towards a signal that is straight between its samples; into ``out`` (walkers, samples).

    ``signal`` (walkers, samples), ``step`` (samples - 1,) in s, ``constant`` and ``start`` (walkers,).
    """
    for w in range(out.shape[0]):
        state = start[w]
        out[w, 0] = state
        for i in range(step.size):
            ratio = step[i] / constant[w]
            lost = -math.expm1(-ratio)
            # Weight of the interval's end.
            late = 1.0 - lost / ratio if ratio > 1e-9 else 0.5 * ratio
            state = (1.0 - lost) * state + late * signal[w, i + 1] + (lost - late) * signal[w, i]
            out[w, i + 1] = state
