"""Cells of the Preisach plane: the one element from which every operator of the class is made.

A cell is a bundle of relays whose upper switching torques fill [up, up + width] and whose lower ones fill [down, down + width],
in the same order: a play operator with a bounded read-out (Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1; Visintin,
Differential Models of Hysteresis, 1994, ch. III). With up = down it is elastic, with up = -(down + width) it is a clearance whose
parts are crossed at torques from up to up + width, whatever lies between is friction. Each cell comes with its mirror image,
so that the operator is odd.
"""

from __future__ import annotations

from dataclasses import dataclass

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

    @property
    def clearance(self) -> np.ndarray:
        """Which pairs cross up at positive torques and down at the opposite ones, (cells,)."""
        return np.isclose(self.up, -(self.down + self.width)) & (self.up >= 0.0)

    def wider(self, factor: float) -> Cells:
        """The same cells with every threshold multiplied by ``factor``; clearances keep their share of the relays, and stay
        where they are beyond CROSSED."""
        clearance = self.clearance
        shift = np.where(clearance, 0.0, (factor - 1.0) * self.threshold)
        scale = np.where(clearance & (self.up + self.width <= CROSSED), factor, 1.0)
        return Cells(scale * self.up + shift, scale * self.down - shift, scale * self.width, scale * self.norm)

    def means(self, history: History, state: str = "neutral", sign: float = 1.0) -> np.ndarray:
        """Block means of the responses, shape (blocks, cells); with ``sign`` -1 of their even counterparts (flanks
        that differ)."""
        return self._paired(_means, history, state, (history.z0, history.z1, history.weight, history.block, history.blocks), sign)

    def ends(self, history: History, state: str = "neutral", sign: float = 1.0) -> np.ndarray:
        """Responses at the end of every segment, shape (segments, cells)."""
        return self._paired(_ends, history, state, (history.z1,), sign)

    def _paired(self, kernel, history, state, arguments, sign):
        up, down = np.r_[self.up, -self.down - self.width], np.r_[self.down, -self.up - self.width]
        width = np.r_[self.width, self.width]
        high, low = np.clip(history.start - down, 0.0, width), np.clip(history.start - up, 0.0, width)
        first = {"upper": high, "lower": low}.get(state)
        if first is None:
            # A clearance rests in its middle whatever the torque: narrow cells must not tell a torque of nothing from its noise.
            at_rest = np.where(np.r_[self.clearance, self.clearance], 0.5 * width, history.start - 0.5 * (up + down))
            first = np.clip(np.clip(at_rest, 0.0, width), low, high)
        response = kernel(*arguments, up, down, width, first)
        centred = response - 0.5 * width
        return (centred[:, : self.count] + sign * centred[:, self.count :]) / self.norm


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


@numba.njit(cache=True, nogil=True)
def _means(z0, z1, weight, block, blocks, up, down, width, first):
    """Exact means over blocks of the states along straight segments, shape (blocks, cells)."""
    out = np.zeros((blocks, up.size))
    for j in range(up.size):
        x, a, b, w = first[j], up[j], down[j], width[j]
        for i in range(z0.size):
            p, q = z0[i], z1[i]
            mean = x
            if q > p and x < w and q > a + x:
                turn = max(p, a + x)
                mean = (x * (turn - p) + _integral(q - a, w) - _integral(turn - a, w)) / (q - p)
                x = max(x, min(q - a, w))
            elif q < p and x > 0.0 and q < b + x:
                turn = min(p, b + x)
                mean = (x * (p - turn) + _integral(turn - b, w) - _integral(q - b, w)) / (p - q)
                x = min(x, max(q - b, 0.0))
            out[block[i], j] += weight[i] * mean
    return out


@numba.njit(cache=True, nogil=True)
def _ends(z1, up, down, width, first):
    """States at the segments' ends, shape (segments, cells)."""
    out = np.empty((z1.size, up.size))
    for j in range(up.size):
        x, a, b, w = first[j], up[j], down[j], width[j]
        for i in range(z1.size):
            x = max(x, min(max(z1[i] - a, 0.0), w))
            x = min(x, min(max(z1[i] - b, 0.0), w))
            out[i, j] = x
    return out
