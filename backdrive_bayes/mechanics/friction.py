"""Friction of the class: the same at every load, plays whose read-out changes with it, flanks in proportion to it."""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag, svd

from backdrive_bayes.mechanics.cells import Cells, join
from backdrive_bayes.mechanics.history import History, through
from backdrive_bayes.mechanics.part import SHARED, TOP, Part, apart, below

THRESHOLDS = np.r_[np.geomspace(0.003, 0.12, 18), np.arange(0.14, 0.94, 0.035)]
"""Thresholds of friction."""
USUAL_SPACING = float(np.log(1.4))
"""Distance in ln r of neighbouring thresholds for which the prior of friction's weights is meant: closer ones share its
variance."""
READ_OUTS = (0.0, 0.02, 0.04, 0.07, 0.12, 0.2, 0.28, 0.38, 0.5, 0.62, 0.75, 0.83, 0.9, 0.95, 1.0)
"""Nodes of friction's read-outs; they must reach the largest torque, or clean loops seem to slip. Both grids are fine, or loops
of two amplitudes seem to follow the rate."""
LOOPS = (0.0, 1.0, -1.0, 1.0, -1.0, 0.7, -0.7, 0.5, -0.2, 0.5, -0.5, 0.5, -0.25, 0.25, -0.25, 0.1, -0.1, 1.0)
"""Turning points of the path whose angles decide which combinations of friction's weights are identified: loops of several
amplitudes and inner ones."""
EVENLY, NEAR = 45, np.geomspace(1e-3, 0.1, 12)
"""Torques of a leg of that path at equal distances, and shares of it next to zero torque and to turning points, where loops
bend."""
LEFT_OUT = 3e-4
"""Share of the prior standard deviation of that path's angle which principal components that are left out have together."""
FRICTION_SCALE = (float(np.log(0.1)), 1.5)
"""Normal prior of the log scales of friction."""
FLANK_ALIKE = 0.3
"""Correlation length of a flank's compliance over the root of the load."""
FLANK_SCALE = (float(np.log(0.01)), 1.5)
"""Normal prior of the log scale of flanks; one scale is learnt for all of them."""
FLANK_NODES = np.r_[np.linspace(0.0, 1.0, 26)[:-1] ** 1.5, TOP]
"""Torques between which the compliance of a flank is constant. A flank that releases beyond zero torque does so in the order in
which it slipped, relays of a cell in the opposite one: the cells are narrow, most of all at small loads."""
FRICTION = ("masing", "friction", "flanks")
"""Parts of friction: the same at every load, as the load wants it, in proportion to it."""
LARGEST_THRESHOLD = 0.3
"""Torque about which thresholds cease to be usual."""


@lru_cache(maxsize=1)
def masing() -> Part:
    """Friction that is the same at every load, elements in parallel or in series that slip at torques of their own.

    Loops of one amplitude have the same width with a threshold r as with that amplitude less r, and elasticity makes up for the
    rest: what a smaller loop is tells the prior alone, by which friction slips at small torques. It falls in variance, not in
    standard deviation as where read-outs differ: one body may slip near full load.
    """
    cells = Cells(THRESHOLDS, -THRESHOLDS, TOP - THRESHOLDS, np.full(THRESHOLDS.size, 2.0))
    small = np.sqrt(below(THRESHOLDS, LARGEST_THRESHOLD))
    root = _root(THRESHOLDS, _spacing(THRESHOLDS), np.outer(small, small))
    return Part("masing", "friction", cells, principal_components(cells, root), FRICTION_SCALE)


@lru_cache(maxsize=1)
def friction() -> Part:
    """Friction whose read-out changes with the load."""
    cells, root = plays(THRESHOLDS)
    return Part("friction", "friction", cells, principal_components(cells, root), FRICTION_SCALE)


@lru_cache(maxsize=8)
def flanks(ratios: tuple[float, ...]) -> Part:
    """Flanks of some ratios, which share a scale."""
    made = [flank(ratio) for ratio in ratios]
    return Part("flanks", "friction", join(*(c for c, _ in made)), block_diag(*(m for _, m in made)), FLANK_SCALE)


def plays(thresholds) -> tuple[Cells, np.ndarray]:
    """Plays of some thresholds by READ_OUTS, and the root of the prior covariance of their weights."""
    rows = []
    for r, share in zip(thresholds, _spacing(thresholds), strict=True):
        for low, high in itertools.pairwise(READ_OUTS):
            if low + r < 1:
                high = TOP - r if high + r >= 1 else high
                rows.append((low + r, low - r, high - low, r, 0.5 * (low + high), share))
    up, down, width, threshold, centre, share = np.array(rows).T
    small = below(threshold, LARGEST_THRESHOLD)
    root = _root(threshold, share, np.outer(small, small) * (0.5 + 0.5 * np.exp(-apart(np.sqrt(centre)) / 0.3)))
    return Cells(up, down, width, np.full(up.size, 2.0)), root


@lru_cache(maxsize=128)
def flank(ratio: float) -> tuple[Cells, np.ndarray]:
    """A flank with Coulomb friction in proportion to its load, which slips back at ``ratio`` of the torque at which it slipped
    forth, (1 - m)/(1 + m) for friction m of the load; and its prior by few weights, (cells, weights)."""
    up, width = FLANK_NODES[:-1], np.diff(FLANK_NODES)
    down = np.minimum(ratio * FLANK_NODES[1:], ratio * up)
    cells = Cells(up, down, width, np.full(width.size, 2.0), abs(ratio) * width)
    near = np.exp(-apart(np.sqrt(up + 0.5 * width)) / FLANK_ALIKE)
    return cells, principal_components(cells, np.linalg.cholesky(near))


def _spacing(thresholds) -> np.ndarray:
    """Distance in ln r of neighbouring thresholds in that for which the prior is meant, (thresholds,)."""
    return np.gradient(np.log(thresholds)) / USUAL_SPACING


def _root(threshold, share, near) -> np.ndarray:
    """Root of the prior covariance of weights, (cells, cells), of elements that slip at about the same torque and of one by
    itself, which may slip at any; times what else is alike in them."""
    both = np.outer(share, share)
    alike = SHARED * both * np.exp(-apart(np.log(threshold)) / 0.7)
    own = (1.0 - SHARED) * (threshold[:, None] == threshold) * np.sqrt(both)
    return np.linalg.cholesky(near * (alike + own) + 1e-9 * np.eye(threshold.size))


def principal_components(cells: Cells, root: np.ndarray) -> np.ndarray:
    """The same prior as that of ``root`` (cells, cells) by fewer weights, (cells, weights): principal components of the angle
    along LOOPS."""
    _, size, turned = svd(cells.ends(loops()) @ root, full_matrices=False)
    left = np.sqrt(np.cumsum(size[::-1] ** 2))[::-1]
    kept = turned[left > LEFT_OUT * left[0]]
    signs = np.sign(kept[np.arange(kept.shape[0]), np.argmax(np.abs(kept), axis=1)])
    return root @ (kept * signs[:, None]).T


def loops() -> History:
    """The path of LOOPS."""
    path = np.concatenate([_leg(a, b) for a, b in itertools.pairwise(LOOPS)])
    return through(np.arange(path.size, dtype=float), path, 1.0)


def _leg(begin: float, end: float) -> np.ndarray:
    """Torques from one turning point to the next, close together where loops bend."""
    share = np.r_[np.linspace(0.0, 1.0, EVENLY)[1:], NEAR]
    zero = begin / (begin - end)
    share = np.r_[share, zero - NEAR, zero + NEAR] if 0.0 < zero < 1.0 else share
    return begin + (end - begin) * np.sort(share[share <= 1.0])
