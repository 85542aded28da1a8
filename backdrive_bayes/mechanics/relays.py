"""Compiled loops over bundles of relays: the share of each that is up, exactly along straight pieces of the torque.

Arrays ``up``, ``down``, ``width``, ``fall`` and ``first`` have shape (cells,): the lowest of the switching torques, how wide they
are spread, and the share that is up at first.
"""

from __future__ import annotations

import numba
import numpy as np

LEAST_WIDTH = 1e-2
"""Share of its width that a cell keeps however much thresholds grow: friction in proportion to the load ends where it locks."""
RUN = 16
"""Segments that are looked at together first: most cells rest through most of a leg. It changes the time alone."""


@numba.njit(cache=True, inline="always")
def _integral(value):
    """Integral of clip(u, 0, 1) over u from 0 to ``value``."""
    if value <= 0.0:
        return 0.0
    if value <= 1.0:
        return 0.5 * value * value
    return value - 0.5


@numba.njit(cache=True)
def first_states(start, state, up, down, width, fall, clearance):
    """Shares (cells,) that are up at the torque ``start`` at rest (``state`` 0), after a large positive torque (1) or after a
    large negative one (2). A clearance rests in its middle whatever the torque: narrow cells must not tell a torque of nothing
    from its noise."""
    out = np.empty(up.size)
    for j in range(up.size):
        high = min(max((start - down[j]) / fall[j], 0.0), 1.0)
        low = min(max((start - up[j]) / width[j], 0.0), 1.0)
        rest = 0.5 if clearance[j] else (2.0 * start - up[j] - down[j]) / (width[j] + fall[j])
        out[j] = high if state == 1 else low if state == 2 else min(max(rest, low), high)
    return out


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


@numba.njit(cache=True, inline="always")
def _beyond(z1, i, end, level, way):
    """The first segment from ``i`` on, before the next turn ``end``, that ends beyond a torque."""
    while i < end:
        middle = (i + end) // 2
        if way * (z1[middle] - level) > 0.0:
            end = middle
        else:
            i = middle + 1
    return i


@numba.njit(cache=True)
def _step(steps, share, x, z0, z1, turns, a, b, u, d):
    """Add ``share`` of a cell to the ``steps`` (segments + 1,) from one segment's mean to the next: between turns it moves once,
    if at all, and where it rests there is none."""
    steps[0] += share * x
    for r in range(turns.size - 1):
        i, end = turns[r], turns[r + 1]
        last, first = z1[end - 1], z0[i]
        if last > first and x < 1.0 and last > a + u * x:
            i = _beyond(z1, i, end, a + u * x, 1.0)
            while i < end and x < 1.0:
                p, q = (z0[i] - a) / u, (z1[i] - a) / u
                if q > p:
                    turn, reached = max(p, x), max(x, min(q, 1.0))
                    mean = (x * (turn - p) + _integral(q) - _integral(turn)) / (q - p)
                    steps[i] += share * (mean - x)
                    steps[i + 1] += share * (reached - mean)
                    x = reached
                i += 1
        elif last < first and x > 0.0 and last < b + d * x:
            i = _beyond(z1, i, end, b + d * x, -1.0)
            while i < end and x > 0.0:
                p, q = (z0[i] - b) / d, (z1[i] - b) / d
                if q < p:
                    turn, reached = min(p, x), min(x, max(q, 0.0))
                    mean = (x * (p - turn) + _integral(turn) - _integral(q)) / (p - q)
                    steps[i] += share * (mean - x)
                    steps[i + 1] += share * (reached - mean)
                    x = reached
                i += 1


@numba.njit(cache=True, nogil=True)
def means(z0, z1, weight, block, blocks, up, down, width, fall, first):
    """Exact means over blocks of the states along straight segments, shape (cells, blocks)."""
    out, steps, turns = np.zeros((up.size, blocks)), np.empty(z0.size + 1), _turns(z0, z1)
    for j in range(up.size):
        steps[:] = 0.0
        _step(steps, 1.0, first[j], z0, z1, turns, up[j], down[j], width[j], fall[j])
        _gather(out[j], steps, weight, block)
    return out


@numba.njit(cache=True, nogil=True)
def summed(z0, z1, weight, block, blocks, up, down, width, fall, first, share):
    """The same times the cells' shares, (blocks,)."""
    out, steps, turns = np.zeros(blocks), np.zeros(z0.size + 1), _turns(z0, z1)
    for j in range(up.size):
        if share[j] != 0.0:
            _step(steps, share[j], first[j], z0, z1, turns, up[j], down[j], width[j], fall[j])
    _gather(out, steps, weight, block)
    return out


@numba.njit(cache=True)
def _gather(out, steps, weight, block):
    """Add to the blocks' means (blocks,) what the ``steps`` from one segment's mean to the next make."""
    total = 0.0
    for i in range(block.size):
        total += steps[i]
        out[block[i]] += weight[i] * total


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
def surged_means(z0, z1, weight, block, blocks, up, down, width, fall, first, f0, f1, m0, m1, threshold, more, follows):
    """Means over blocks of states whose thresholds are multiplied by a factor that runs from f0 to f1 along each segment, a drag
    from m0 to m1 added to them, shape (cells, blocks)."""
    out, mean, runs = np.zeros((up.size, blocks)), np.empty(z0.size), _runs(z1, f1, m1)
    for j in range(up.size):
        edges = up[j], down[j], width[j], fall[j]
        _surge(mean, first[j], z0, z1, f0, f1, m0, m1, runs, edges, threshold[j], more[j], follows[j], False)
        for i in range(z0.size):
            out[j, block[i]] += weight[i] * mean[i]
    return out


@numba.njit(cache=True, nogil=True)
def surged_sum(z0, z1, weight, block, blocks, up, down, width, fall, first, share, f0, f1, m0, m1, threshold, more, follows):
    """The same times the cells' shares, (blocks,)."""
    out, mean, total, runs = np.zeros(blocks), np.empty(z0.size), np.zeros(z0.size), _runs(z1, f1, m1)
    for j in range(up.size):
        if share[j] != 0.0:
            edges = up[j], down[j], width[j], fall[j]
            _surge(mean, first[j], z0, z1, f0, f1, m0, m1, runs, edges, threshold[j], more[j], follows[j], False)
            for i in range(z0.size):
                total[i] += share[j] * mean[i]
    for i in range(z0.size):
        out[block[i]] += weight[i] * total[i]
    return out


@numba.njit(cache=True, nogil=True)
def surged_ends(z0, z1, up, down, width, fall, first, f0, f1, m0, m1, threshold, more, follows):
    """The same at the segments' ends, shape (cells, segments)."""
    out, runs = np.empty((up.size, z0.size)), _runs(z1, f1, m1)
    for j in range(up.size):
        edges = up[j], down[j], width[j], fall[j]
        _surge(out[j], first[j], z0, z1, f0, f1, m0, m1, runs, edges, threshold[j], more[j], follows[j], True)
    return out


@numba.njit(cache=True, nogil=True)
def _runs(z1, f1, m1):
    """Lowest and highest torque, and factor, and lowest drag of every run of segments, (runs, 5)."""
    out = np.empty((z1.size // RUN + 1, 5))
    for k in range(0, z1.size, RUN):
        z, f = z1[k : k + RUN], f1[k : k + RUN]
        out[k // RUN] = z.min(), z.max(), f.min(), f.max(), m1[k : k + RUN].min()
    return out


@numba.njit(cache=True, inline="always")
def _rests(run, x, edges, r, more, follows):
    """Whether a state stays through a run: it does where it does at the run's least and largest factor."""
    low, high, least, most, drag = run
    a, b, u, d = edges
    for factor in (least, most):
        g = factor - 1.0
        # The upper bound is concave in the factor and the lower one convex, so that both ends tell.
        above = a + u + (r + more) * g - (1.0 - x) * max(u + more * g, LEAST_WIDTH * u)
        below = b - r * g + x * max(d - more * g, LEAST_WIDTH * d)
        if follows:
            above, below = factor * (a + x * u), factor * (b + x * d)
        if (x < 1.0 and high > above + drag) or (x > 0.0 and low < below - drag):
            return False
    return True


@numba.njit(cache=True, inline="always")
def _edges(z, factor, drag, edges, r, more, follows):
    """Distances of a torque from the first upper and lower switching torques of a cell, and the widths of both, at a factor and
    an added drag."""
    a, b, u, d = edges
    if follows:
        return z - drag - a * factor, z + drag - b * factor, u * factor, d * factor
    g = factor - 1.0
    wide = max(u + more * g, LEAST_WIDTH * u)
    # Where a width is at its least, the mirror image of the first relay stays, which is the last one.
    return z - drag - r * g - a + wide - u - more * g, z + drag + r * g - b, wide, max(d - more * g, LEAST_WIDTH * d)


@numba.njit(cache=True, nogil=True)
def _surge(out, x, z0, z1, f0, f1, m0, m1, runs, edges, r, more, follows, ends):
    """States (segments,) of one cell: the upper torque of a play rises, and its lower one falls, by what its threshold gains,
    which is ``r`` at its first relay and ``more`` than that at its last; a clearance that ``follows`` feels the torque divided by
    the factor."""
    for k in range(0, z0.size, RUN):
        if k > 0 and _rests(runs[k // RUN], x, edges, r, more, follows):
            out[k : k + RUN] = x
            continue
        for i in range(k, min(k + RUN, z0.size)):
            p1, q1, u1, d1 = _edges(z1[i], f1[i], m1[i], edges, r, more, follows)
            # Resting takes no division.
            if i > 0 and (x >= 1.0 or p1 <= x * u1) and (x <= 0.0 or q1 >= x * d1):
                out[i] = x
                continue
            p0, q0, u0, d0 = _edges(z0[i], f0[i], m0[i], edges, r, more, follows)
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
