"""Cells of the Preisach plane: the one element from which every operator of the class is made.

A cell is a bundle of relays whose upper switching torques fill [up, up + width] and whose lower ones fill [down, down + width],
in the same order: a play operator with a bounded read-out (Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1; Visintin,
Differential Models of Hysteresis, 1994, ch. III). With up = down it is elastic, with up = -(down + width) it is a clearance whose
parts are crossed at torques from up to up + width, whatever lies between is friction. Each cell comes with its mirror image,
so that the operator is odd.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from scipy import sparse

from backdrive_bayes.mechanics.history import History

CROSSED = 0.7
"""Torque, in shares of the largest, by which clearances are crossed: relays beyond stand for friction near the loop's tip."""
START = ("neutral", "upper", "lower")
"""Initial states: demagnetised (a clearance in its middle), as after a large positive torque, as after a large negative one."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Odd pairs of cells, arrays of shape (cells,) in shares of the torque scale.

    The response of a pair runs from -width to +width and is divided by ``norm``. ``growth`` is that of the thresholds along a
    history, None where they stay.
    """

    up: np.ndarray
    down: np.ndarray
    width: np.ndarray
    norm: np.ndarray
    growth: np.ndarray | None = None

    @property
    def count(self) -> int:
        """Number of pairs."""
        return self.up.size

    @property
    def threshold(self) -> np.ndarray:
        """Half the distance between upper and lower switching torques, (cells,)."""
        return 0.5 * (self.up - self.down)

    @property
    def centre(self) -> np.ndarray:
        """Torque in the middle between them, (cells,)."""
        return 0.5 * (self.up + self.down + self.width)

    @cached_property
    def clearance(self) -> np.ndarray:
        """Which pairs cross up at positive torques and down at the opposite ones, (cells,)."""
        return (np.abs(self.up + self.down + self.width) <= 1e-8 + 1e-5 * np.abs(self.up)) & (self.up >= 0.0)

    def grown(self, growth) -> Cells:
        """The cells with every threshold multiplied by exp(``growth``), one logarithm or one at either end of every segment of
        the histories to come, (2, segments)."""
        if np.ndim(growth):
            return replace(self, growth=growth)
        return self.wider(float(np.exp(growth))) if growth else self

    def wider(self, factor: float) -> Cells:
        """The same cells with every threshold multiplied by ``factor``; clearances keep their share of the relays, and stay
        where they are beyond CROSSED."""
        clearance = self.clearance
        shift = np.where(clearance, 0.0, (factor - 1.0) * self.threshold)
        scale = np.where(clearance & (self.up + self.width <= CROSSED), factor, 1.0)
        return Cells(scale * self.up + shift, scale * self.down - shift, scale * self.width, scale * self.norm)

    def means(self, history: History, sign: float = 1.0) -> np.ndarray:
        """Block means of the responses, shape (blocks, cells); with ``sign`` -1 of their even counterparts (flanks
        that differ)."""
        if self.growth is not None:
            return self._paired(_surged(False, *self._surging(history)) @ _shares(history), sign)
        return self._paired(_means(*_segments(history), *self._relays(history.start, history.state)), sign)

    def ends(self, history: History, sign: float = 1.0) -> np.ndarray:
        """Responses at the end of every segment, shape (segments, cells)."""
        if self.growth is not None:
            return self._paired(_surged(True, *self._surging(history)), sign)
        return self._paired(_ends(history.z1, *self._relays(history.start, history.state)), sign)

    def summed(self, history: History, weights, sign: float = 1.0) -> np.ndarray:
        """Block means times ``weights`` (cells,), (blocks,)."""
        share = np.concatenate([weights / self.norm, sign * weights / self.norm])
        if self.growth is not None:
            found = _surged_sum(share, *self._surging(history)) @ _shares(history)
        else:
            arguments = *_segments(history), *self._relays(history.start, history.state), share
            found = _summed(*arguments)
        return found - 0.5 * (1.0 + sign) * float(weights @ (self.width / self.norm))

    def _surging(self, history):
        """Torques, factors of the thresholds and all relays whose thresholds grow."""
        follows = self.clearance & (self.up + self.width <= CROSSED)
        threshold = np.where(self.clearance, 0.0, self.threshold)
        relays = self._relays(history.start, history.state)
        return history.z0, history.z1, *np.exp(self.growth), *relays, np.tile(threshold, 2), np.tile(follows, 2)

    @cached_property
    def _both(self):
        """Upper and lower switching torques and widths of all cells and then of their mirror images, and the clearances."""
        up, down = (np.concatenate(p) for p in ((self.up, -self.down - self.width), (self.down, -self.up - self.width)))
        return up, down, np.tile(self.width, 2), np.tile(self.clearance, 2)

    def _relays(self, start, state):
        """Switching torques, widths and first states of all relays."""
        up, down, width, clearance = self._both
        high, low = (np.minimum(np.maximum(start - edge, 0.0), width) for edge in (down, up))
        first = {"upper": high, "lower": low}.get(state)
        if first is None:
            # A clearance rests in its middle whatever the torque: narrow cells must not tell a torque of nothing from its noise.
            at_rest = np.where(clearance, 0.5 * width, start - 0.5 * (up + down))
            first = np.minimum(np.maximum(at_rest, low), high)
        return up, down, width, first

    def _paired(self, response, sign):
        """Responses of pairs (…, cells) from those of all relays (relays, …)."""
        one, other = response[: self.count], response[self.count :]
        width, norm = self.width[:, None], self.norm[:, None]
        return ((one + sign * other - 0.5 * (1.0 + sign) * width) / norm).T


def _shares(history):
    """Shares of the segments in the blocks, sparse (segments, blocks)."""
    rows = np.arange(history.weight.size)
    return sparse.csr_array((history.weight, (rows, history.block)), shape=(rows.size, history.blocks))


def _segments(history):
    return history.z0, history.z1, history.weight, history.block, history.blocks


def join(*cells: Cells) -> Cells:
    """All pairs one after the other."""
    return Cells(*(np.concatenate([getattr(c, name) for c in cells]) for name in ("up", "down", "width", "norm")))


@numba.njit(cache=True, inline="always")
def _integral(value, width):
    """Integral of clip(u, 0, width) over u from 0 to ``value``."""
    if value <= 0.0:
        return 0.0
    if value <= width:
        return 0.5 * value * value
    return 0.5 * width * width + width * (value - width)


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
def _follow(mean, x, z0, z1, turns, a, b, w):
    """Means (segments,) of a cell's state along every segment; between turns it moves once, if at all."""
    for r in range(turns.size - 1):
        i, end = turns[r], turns[r + 1]
        last, first = z1[end - 1], z0[i]
        if last > first and x < w and last > a + x:
            while z1[i] <= a + x:
                mean[i] = x
                i += 1
            while i < end and x < w:
                p, q = z0[i], z1[i]
                mean[i] = x
                if q > p:
                    turn = max(p, a + x)
                    mean[i] = (x * (turn - p) + _integral(q - a, w) - _integral(turn - a, w)) / (q - p)
                    x = max(x, min(q - a, w))
                i += 1
        elif last < first and x > 0.0 and last < b + x:
            while z1[i] >= b + x:
                mean[i] = x
                i += 1
            while i < end and x > 0.0:
                p, q = z0[i], z1[i]
                mean[i] = x
                if q < p:
                    turn = min(p, b + x)
                    mean[i] = (x * (p - turn) + _integral(turn - b, w) - _integral(q - b, w)) / (p - q)
                    x = min(x, max(q - b, 0.0))
                i += 1
        mean[i:end] = x


@numba.njit(cache=True, nogil=True)
def _means(z0, z1, weight, block, blocks, up, down, width, first):
    """Exact means over blocks of the states along straight segments, shape (cells, blocks)."""
    out, mean, turns = np.zeros((up.size, blocks)), np.empty(z0.size), _turns(z0, z1)
    for j in range(up.size):
        _follow(mean, first[j], z0, z1, turns, up[j], down[j], width[j])
        for i in range(z0.size):
            out[j, block[i]] += weight[i] * mean[i]
    return out


@numba.njit(cache=True, nogil=True)
def _summed(z0, z1, weight, block, blocks, up, down, width, first, share):
    """The same times the cells' shares, (blocks,)."""
    out, mean, turns, total = np.zeros(blocks), np.empty(z0.size), _turns(z0, z1), np.zeros(z0.size)
    for j in range(up.size):
        _follow(mean, first[j], z0, z1, turns, up[j], down[j], width[j])
        for i in range(z0.size):
            total[i] += share[j] * mean[i]
    for i in range(z0.size):
        out[block[i]] += weight[i] * total[i]
    return out


@numba.njit(cache=True, nogil=True)
def _ends(z1, up, down, width, first):
    """States at the segments' ends, shape (cells, segments)."""
    out = np.empty((up.size, z1.size))
    for j in range(up.size):
        x, a, b, w = first[j], up[j], down[j], width[j]
        for i in range(z1.size):
            x = max(x, min(max(z1[i] - a, 0.0), w))
            x = min(x, min(max(z1[i] - b, 0.0), w))
            out[j, i] = x
    return out


@numba.njit(cache=True, nogil=True)
def _surged(ends, z0, z1, f0, f1, up, down, width, first, threshold, follows):
    """States (cells, segments) whose thresholds are multiplied by a factor that runs from f0 to f1 along each segment, means or
    those at its end."""
    out = np.empty((up.size, z0.size))
    for j in range(up.size):
        _surge(out[j], first[j], z0, z1, f0, f1, up[j], down[j], width[j], threshold[j], follows[j], ends)
    return out


@numba.njit(cache=True, nogil=True)
def _surged_sum(share, z0, z1, f0, f1, up, down, width, first, threshold, follows):
    """Means of the same times the cells' shares, (segments,)."""
    mean, total = np.empty(z0.size), np.zeros(z0.size)
    for j in range(up.size):
        if share[j] != 0.0:
            _surge(mean, first[j], z0, z1, f0, f1, up[j], down[j], width[j], threshold[j], follows[j], False)
            total += share[j] * mean
    return total


@numba.njit(cache=True, nogil=True)
def _surge(out, x, z0, z1, f0, f1, a, b, w, r, follows, ends):
    """States (segments,) of one cell: the lower torque of a play rises, and its upper one falls, by what its threshold ``r``
    loses; a clearance that ``follows`` feels the torque divided by the factor."""
    for i in range(z0.size):
        if follows:
            p0, p1 = z0[i] / f0[i], z1[i] / f1[i]
            q0, q1 = p0, p1
        else:
            less0, less1 = r * (f0[i] - 1.0), r * (f1[i] - 1.0)
            p0, p1, q0, q1 = z0[i] - less0, z1[i] - less1, z0[i] + less0, z1[i] + less1
        if i == 0:
            x = min(max(x, min(p0 - a, w)), max(q0 - b, 0.0))
        mean = x
        if p1 > p0 and p1 > a + x and x < w:
            turn = max(p0, a + x)
            mean = (x * (turn - p0) + _integral(p1 - a, w) - _integral(turn - a, w)) / (p1 - p0)
            x = max(x, min(p1 - a, w))
        elif q1 < q0 and q1 < b + x and x > 0.0:
            turn = min(q0, b + x)
            mean = (x * (q0 - turn) + _integral(turn - b, w) - _integral(q1 - b, w)) / (q0 - q1)
            x = min(x, max(q1 - b, 0.0))
        out[i] = x if ends else mean
