"""Compiled loops over bundles of relays: the share of each that is up, exactly along straight pieces of the torque.

Arrays ``up``, ``down``, ``width``, ``fall`` and ``first`` have shape (cells,): the lowest of the switching torques, how wide they
are spread, and the share that is up at first.
"""

from __future__ import annotations

import numba
import numpy as np

LEAST_WIDTH = 1e-2
"""Share of its width that a cell keeps however much thresholds grow: friction in proportion to the load ends where it locks."""


@numba.njit(cache=True, inline="always")
def _integral(value):
    """Integral of clip(u, 0, 1) over u from 0 to ``value``."""
    if value <= 0.0:
        return 0.0
    if value <= 1.0:
        return 0.5 * value * value
    return value - 0.5


@numba.njit(cache=True)
def _turns(z0, z1):
    """Numbers of the segments at which the torque turns, the first and one past the last among them."""
    found, rising = [0], 0.0
    for i in range(z0.size):
        step = z1[i] - z0[i]
        if step * rising < 0.0:
            found.append(i)
        if step != 0.0:
            rising = step
    found.append(z0.size)
    return np.array(found)


@numba.njit(cache=True)
def _follow(mean, x, z0, z1, turns, a, b, u, d):
    """Means (segments,) of the share of a cell's relays that are up along every segment; between turns it moves once, if at
    all."""
    for r in range(turns.size - 1):
        i, end = turns[r], turns[r + 1]
        last, first = z1[end - 1], z0[i]
        if last > first and x < 1.0 and last > a + u * x:
            while z1[i] <= a + u * x:
                mean[i] = x
                i += 1
            while i < end and x < 1.0:
                p, q = (z0[i] - a) / u, (z1[i] - a) / u
                mean[i] = x
                if q > p:
                    turn = max(p, x)
                    mean[i] = (x * (turn - p) + _integral(q) - _integral(turn)) / (q - p)
                    x = max(x, min(q, 1.0))
                i += 1
        elif last < first and x > 0.0 and last < b + d * x:
            while z1[i] >= b + d * x:
                mean[i] = x
                i += 1
            while i < end and x > 0.0:
                p, q = (z0[i] - b) / d, (z1[i] - b) / d
                mean[i] = x
                if q < p:
                    turn = min(p, x)
                    mean[i] = (x * (p - turn) + _integral(turn) - _integral(q)) / (p - q)
                    x = min(x, max(q, 0.0))
                i += 1
        mean[i:end] = x


@numba.njit(cache=True, nogil=True)
def means(z0, z1, weight, block, blocks, up, down, width, fall, first):
    """Exact means over blocks of the states along straight segments, shape (cells, blocks)."""
    out, mean, turns = np.zeros((up.size, blocks)), np.empty(z0.size), _turns(z0, z1)
    for j in range(up.size):
        _follow(mean, first[j], z0, z1, turns, up[j], down[j], width[j], fall[j])
        for i in range(z0.size):
            out[j, block[i]] += weight[i] * mean[i]
    return out


@numba.njit(cache=True, nogil=True)
def summed(z0, z1, weight, block, blocks, up, down, width, fall, first, share):
    """The same times the cells' shares, (blocks,)."""
    out, mean, turns, total = np.zeros(blocks), np.empty(z0.size), _turns(z0, z1), np.zeros(z0.size)
    for j in range(up.size):
        _follow(mean, first[j], z0, z1, turns, up[j], down[j], width[j], fall[j])
        for i in range(z0.size):
            total[i] += share[j] * mean[i]
    for i in range(z0.size):
        out[block[i]] += weight[i] * total[i]
    return out


@numba.njit(cache=True, nogil=True)
def ends(z1, up, down, width, fall, first):
    """States at the segments' ends, shape (cells, segments)."""
    out = np.empty((up.size, z1.size))
    for j in range(up.size):
        x, a, b, u, d = first[j], up[j], down[j], width[j], fall[j]
        for i in range(z1.size):
            x = max(x, min(max((z1[i] - a) / u, 0.0), 1.0))
            x = min(x, min(max((z1[i] - b) / d, 0.0), 1.0))
            out[j, i] = x
    return out


@numba.njit(cache=True, nogil=True)
def surged(ends, z0, z1, f0, f1, up, down, width, fall, first, threshold, more, follows):
    """States (cells, segments) whose thresholds are multiplied by a factor that runs from f0 to f1 along each segment, means or
    those at its end."""
    out = np.empty((up.size, z0.size))
    for j in range(up.size):
        edges = up[j], down[j], width[j], fall[j]
        _surge(out[j], first[j], z0, z1, f0, f1, edges, threshold[j], more[j], follows[j], ends)
    return out


@numba.njit(cache=True, nogil=True)
def surged_sum(share, z0, z1, f0, f1, up, down, width, fall, first, threshold, more, follows):
    """Means of the same times the cells' shares, (segments,)."""
    mean, total = np.empty(z0.size), np.zeros(z0.size)
    for j in range(up.size):
        if share[j] != 0.0:
            edges = up[j], down[j], width[j], fall[j]
            _surge(mean, first[j], z0, z1, f0, f1, edges, threshold[j], more[j], follows[j], False)
            total += share[j] * mean
    return total


@numba.njit(cache=True, inline="always")
def _edges(z, factor, edges, r, more, follows):
    """Distances of a torque from the first upper and lower switching torques of a cell, and the widths of both, at a factor."""
    a, b, u, d = edges
    if follows:
        return z - a * factor, z - b * factor, u * factor, d * factor
    g = factor - 1.0
    return z - r * g - a, z + r * g - b, max(u + more * g, LEAST_WIDTH * u), max(d - more * g, LEAST_WIDTH * d)


@numba.njit(cache=True, nogil=True)
def _surge(out, x, z0, z1, f0, f1, edges, r, more, follows, ends):
    """States (segments,) of one cell: the upper torque of a play rises, and its lower one falls, by what its threshold gains,
    which is ``r`` at its first relay and ``more`` than that at its last; a clearance that ``follows`` feels the torque divided by
    the factor."""
    for i in range(z0.size):
        p1, q1, u1, d1 = _edges(z1[i], f1[i], edges, r, more, follows)
        # Most cells rest on most segments: that takes no division.
        if i > 0 and (x >= 1.0 or p1 <= x * u1) and (x <= 0.0 or q1 >= x * d1):
            out[i] = x
            continue
        p0, q0, u0, d0 = _edges(z0[i], f0[i], edges, r, more, follows)
        p0, p1, q0, q1 = p0 / u0, p1 / u1, q0 / d0, q1 / d1
        if i == 0:
            x = min(max(x, min(p0, 1.0)), max(q0, 0.0))
        mean = x
        if p1 > p0 and p1 > x and x < 1.0:
            turn = max(p0, x)
            mean = (x * (turn - p0) + _integral(p1) - _integral(turn)) / (p1 - p0)
            x = max(x, min(p1, 1.0))
        elif q1 < q0 and q1 < x and x > 0.0:
            turn = min(q0, x)
            mean = (x * (q0 - turn) + _integral(turn) - _integral(q1)) / (q0 - q1)
            x = min(x, max(q1, 0.0))
        out[i] = x if ends else mean
