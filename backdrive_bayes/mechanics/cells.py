"""Cells of the Preisach plane: the one element from which every operator of the class is made.

A cell is a bundle of relays whose upper switching torques fill [up, up + width] and whose lower ones fill [down, down + width],
in the same order: a play operator with a bounded read-out (Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1; Visintin,
Differential Models of Hysteresis, 1994, ch. III). With up = down it is elastic, with up = -(down + width) it is a clearance whose
parts are crossed at torques from up to up + width, whatever lies between is friction. Each cell comes with its mirror image,
so that the operator is odd.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np

from backdrive_bayes.mechanics.history import History

CROSSED = 0.7
"""Torque, in shares of the largest, by which clearances are crossed: relays beyond stand for friction near the loop's tip."""
START = ("neutral", "upper", "lower")
"""Initial states: demagnetised (a clearance in its middle), as after a large positive torque, as after a large negative one."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Odd pairs of cells, arrays of shape (cells,) in shares of the torque scale.

    The response of a pair runs from -width to +width and is divided by ``norm``.
    """

    up: np.ndarray
    down: np.ndarray
    width: np.ndarray
    norm: np.ndarray

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
        return self._paired(_means(*_segments(history), *self._relays(history.start, history.state)), sign)

    def ends(self, history: History, sign: float = 1.0) -> np.ndarray:
        """Responses at the end of every segment, shape (segments, cells)."""
        return self._paired(_ends(history.z1, *self._relays(history.start, history.state)), sign)

    def summed(self, history: History, weights, sign: float = 1.0) -> np.ndarray:
        """Block means times ``weights`` (cells,), (blocks,)."""
        share = np.concatenate([weights / self.norm, sign * weights / self.norm])
        arguments = *_segments(history), *self._relays(history.start, history.state), share
        return _summed(*arguments) - 0.5 * (1.0 + sign) * float(weights @ (self.width / self.norm))

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
