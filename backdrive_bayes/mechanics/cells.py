"""Cells of the Preisach plane: the one element from which every operator of the class is made.

A cell is a bundle of relays whose upper switching torques fill [up, up + width] and whose lower ones fill [down, down + fall],
in the same order: a play operator with a bounded read-out (Mayergoyz, Mathematical Models of Hysteresis, 1991, ch. 1; Visintin,
Differential Models of Hysteresis, 1994, ch. III). With up = down it is elastic, with up = -(down + width) it is a clearance whose
parts are crossed at torques from up to up + width, whatever lies between is friction: of a fixed threshold where both fill as
wide a range, in proportion to the load where the ranges are in the ratio of their torques. Each cell comes with its mirror image,
so that the operator is odd.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from backdrive_bayes.mechanics.history import History
from backdrive_bayes.mechanics.relays import LEAST_WIDTH, ends, first_states, means, summed, surged_ends, surged_means, surged_sum

CROSSED = 0.7
"""Torque, in shares of the largest, by which clearances are crossed: relays beyond stand for friction near the loop's tip."""
START = ("neutral", "upper", "lower")
"""Initial states: demagnetised (a clearance in its middle), as after a large positive torque, as after a large negative one."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Odd pairs of cells, arrays of shape (cells,) in shares of the torque scale.

    The response of a pair runs from -width to +width and is divided by ``norm``; ``fall`` is the width of the lower switching
    torques, by default the same. ``growth`` is that of the thresholds along a history and ``drag`` what is added to them, None
    where they stay.
    """

    up: np.ndarray
    down: np.ndarray
    width: np.ndarray
    norm: np.ndarray
    fall: np.ndarray = field(default_factory=lambda: np.empty(0))
    growth: np.ndarray | None = None
    drag: np.ndarray | None = None

    def __post_init__(self):
        if self.fall.size == 0:
            object.__setattr__(self, "fall", self.width)

    @property
    def count(self) -> int:
        """Number of pairs."""
        return self.up.size

    @property
    def threshold(self) -> np.ndarray:
        """Half the distance between upper and lower switching torques, (cells,), of the middle relay."""
        return 0.5 * (self.up - self.down) + 0.25 * (self.width - self.fall)

    @property
    def centre(self) -> np.ndarray:
        """Torque in the middle between them, (cells,)."""
        return 0.5 * (self.up + self.down) + 0.25 * (self.width + self.fall)

    @cached_property
    def clearance(self) -> np.ndarray:
        """Which pairs cross up at positive torques and down at the opposite ones, (cells,)."""
        return (np.abs(self.up + self.down + self.width) <= 1e-8 + 1e-5 * np.abs(self.up)) & (self.up >= 0.0)

    def grown(self, growth, drag=0.0) -> Cells:
        """The cells with every threshold multiplied by exp(``growth``) and ``drag`` added to it, as of a play before the whole
        operator; each one number or one at either end of every segment of the histories to come, (2, segments)."""
        if np.ndim(growth) or np.ndim(drag):
            growth, drag = np.broadcast_arrays(growth, drag)
            return replace(self, growth=growth, drag=drag)
        wide = self.wider(float(np.exp(growth))) if growth else self
        return replace(wide, up=wide.up + drag, down=wide.down - drag) if drag else wide

    def wider(self, factor: float) -> Cells:
        """The same cells with every threshold multiplied by ``factor``; clearances keep their share of the relays, and stay
        where they are beyond CROSSED."""
        clearance = self.clearance
        shift, wider = (np.where(clearance, 0.0, (factor - 1.0) * of) for of in self._thresholds)
        scale = np.where(clearance & (self.up + self.width <= CROSSED), factor, 1.0)
        up, down, width, fall = (scale * of for of in (self.up, self.down, self.width, self.fall))
        width, fall = width + wider, np.maximum(fall - wider, LEAST_WIDTH * fall)
        return Cells(up + shift, down - shift, width, self.norm * width / self.width, fall)

    @property
    def _thresholds(self):
        """Threshold of the first relay, and by how much that of the last one is larger."""
        return 0.5 * (self.up - self.down), 0.5 * (self.width - self.fall)

    def means(self, history: History, sign: float = 1.0) -> np.ndarray:
        """Block means of the responses, shape (blocks, cells); with ``sign`` -1 of their even counterparts (flanks
        that differ)."""
        along, relays = _segments(history), self._relays(history)
        found = means(*along, *relays) if self.growth is None else surged_means(*along, *relays, *self._growing)
        return self._paired(found, sign)

    def ends(self, history: History, sign: float = 1.0) -> np.ndarray:
        """Responses at the end of every segment, shape (segments, cells)."""
        relays = self._relays(history)
        found = ends(history.z1, *relays) if self.growth is None else surged_ends(history.z0, history.z1, *relays, *self._growing)
        return self._paired(found, sign)

    def summed(self, history: History, weights, sign: float = 1.0) -> np.ndarray:
        """Block means times ``weights`` (cells,), (blocks,)."""
        share = weights * self.width / self.norm
        along = *_segments(history), *self._relays(history), np.concatenate([share, sign * share])
        found = summed(*along) if self.growth is None else surged_sum(*along, *self._growing)
        return found - 0.5 * (1.0 + sign) * float(share.sum())

    @cached_property
    def _growing(self):
        """Factors at either end of every segment, and what of the thresholds of all relays they multiply."""
        follows = self.clearance & (self.up + self.width <= CROSSED)
        first, more = (np.where(self.clearance, 0.0, of) for of in self._thresholds)
        # The first relay of a mirror image is the mirror image of the last.
        along = *np.exp(self.growth), *np.ascontiguousarray(self.drag, float)
        return *along, np.r_[first, first + more], np.r_[more, -more], np.tile(follows, 2)

    @cached_property
    def _both(self):
        """Upper and lower switching torques of all cells and then of their mirror images, their widths, and the clearances."""
        up, down = (np.concatenate(p) for p in ((self.up, -self.down - self.fall), (self.down, -self.up - self.width)))
        widths = np.concatenate([self.width, self.fall]), np.concatenate([self.fall, self.width])
        return up, down, *widths, np.tile(self.clearance, 2)

    def _relays(self, history):
        """Switching torques, widths and first states of all relays, which are those of the thresholds at that moment."""
        first = self
        if self.growth is not None:
            first = replace(self, growth=None, drag=None).grown(float(self.growth[0, 0]), float(self.drag[0, 0]))
        return *self._both[:4], first_states(history.start, START.index(history.state), *first._both)

    def _paired(self, response, sign):
        """Responses of pairs (…, cells) from those of all relays (relays, …)."""
        one, other = response[: self.count], response[self.count :]
        return ((one + sign * other - 0.5 * (1.0 + sign)) * (self.width / self.norm)[:, None]).T


def _segments(history):
    return history.z0, history.z1, history.weight, history.block, history.blocks


def join(*cells: Cells) -> Cells:
    """All pairs one after the other."""
    return Cells(*(np.concatenate([getattr(c, name) for c in cells]) for name in ("up", "down", "width", "norm", "fall")))
