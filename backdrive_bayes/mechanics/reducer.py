"""The class of clean reducers: odd, rate-independent hysteresis operators, linear in their weights.

Seven parts share the Preisach plane: a constant compliance, smooth elasticity beside it, friction of three kinds (plays that are
the same at every load; plays whose read-out changes with it; flanks, whose friction is in proportion to it), clearance (relays
that cross at +a and back at -a, each tooth at its own a) and free play (steps without drag).
Clearance and free play are refined where the loops are steep; together they hold any odd settled loop at the resolution of their
knots.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.linalg import block_diag, svd

from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.cells import Cells, join
from backdrive_bayes.mechanics.history import History, through

TOP = 1.2
"""Torque up to which cells reach, in the unit's largest: an offset of the torque channel must not leave the class."""
THRESHOLDS = np.r_[np.geomspace(0.003, 0.12, 18), np.arange(0.14, 0.94, 0.035)]
"""Thresholds of friction; a bearing that slips at one torque bends the loop at one distance from its tips, so one more may be
placed between them."""
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
ELASTIC_NODES = (0.0, 0.015, 0.04, 0.08, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95, 1.0)
FLANK_ALIKE = 0.3
"""Correlation length of a flank's compliance over the root of the load."""
FLANK_SCALE = (float(np.log(0.01)), 1.5)
"""Normal prior of the log scale of flanks; one scale is learnt for all of them."""
FLANK_NODES = np.r_[np.linspace(0.0, 1.0, 26)[:-1] ** 1.5, TOP]
"""Torques between which the compliance of a flank is constant. A flank that releases beyond zero torque does so in the order in
which it slipped, relays of a cell in the opposite one: the cells are narrow, most of all at small loads."""
FRICTION = ("masing", "friction", "flanks")
"""Parts of friction: the same at every load, as the load wants it, in proportion to it."""
GROWING = (FRICTION, ("clearance",))
"""Parts whose thresholds follow the rate and the amplitude: of friction, and drags."""
GROWTH_STEP = 2e-3
"""Step of the difference quotients by the growth of thresholds."""
LARGEST_THRESHOLD, LARGEST_DRAG = 0.3, 0.15
"""Torques about which thresholds of friction, and drags of clearance and free play, cease to be usual."""
SHARED, ALIKE = 0.97, 0.15
"""Share of the variance of clearance and free play that neighbours have in common, and the correlation's length in shares of all
knots. These and the largest drag: of what was tried, what made the marginal likelihood of clean units highest on four benches.
Thresholds of friction have the same share in common."""
HALVINGS = 4
"""How often the interval of knots next to zero is halved: the width at zero torque is that of a point, block means are not."""
TOPMOST = 3
"""Intervals of knots that make the topmost one: with fewer blocks in it its steps are not told, and loops bend at their tips."""
BASELINE = ("geometric", "elastic", "friction")


@dataclass(frozen=True, eq=False)
class Part:
    """One part of the class: its cells, and ``mixing`` (cells, cells) that turns independent weights into the prior's.

    ``log_scale`` is mean and standard deviation of the normal prior on the log standard deviation of the weights, in shares of
    the angle scale.
    """

    name: str
    module: str
    cells: Cells
    mixing: np.ndarray | None
    log_scale: tuple[float, float]

    def mix(self, responses: np.ndarray) -> np.ndarray:
        """Columns of independent weights from responses of the cells."""
        return responses if self.mixing is None else responses @ self.mixing

    def weights(self, independent: np.ndarray) -> np.ndarray:
        """Weights of the cells from independent ones, shape (cells, …)."""
        return independent if self.mixing is None else self.mixing @ independent


@dataclass(frozen=True, eq=False)
class ReducerClass:
    """Parts of the class with clearance knots ``knots`` (rising from 0 to TOP), ``bearings`` that slip at thresholds of their
    own, and flanks that slip back at ``ratios`` of the torque at which they slipped forth."""

    knots: np.ndarray
    modules: tuple[str, ...] = BASELINE
    bearings: np.ndarray = field(default_factory=lambda: np.empty(0))
    ratios: np.ndarray = field(default_factory=lambda: np.empty(0))
    parts: tuple[Part, ...] = field(init=False)

    def __post_init__(self):
        unknown = [m for m in self.modules if m not in BASELINE]
        if unknown or "elastic" not in self.modules:
            raise BadInput("--baseline", f"modules out of {', '.join(BASELINE)}, elastic among them", ",".join(self.modules))
        friction = (_masing(tuple(self.bearings.tolist())), _friction(), *_flanks(tuple(self.ratios.tolist())))
        made = (_compliance(), _elastic(), *friction, _clearance(self.knots), _free_play(self.knots))
        object.__setattr__(self, "parts", tuple(p for p in made if p.module in self.modules))

    @property
    def richness(self) -> int:
        """Number of knots, bearings and ratios."""
        return self.knots.size + self.bearings.size + self.ratios.size

    def part(self, name: str) -> Part:
        """A part by name; its module must not be left out."""
        return next(p for p in self.parts if p.name == name)

    def columns(self, history: History, growth=(0.0, 0.0)) -> dict[str, np.ndarray]:
        """Block means of every part's columns, (blocks, weights) by name.

        Friction and drag thresholds are multiplied by exp(growth), either the same everywhere or (2, segments).
        """
        return {p.name: p.mix(_cells(p, growth).means(history)) for p in self.parts}

    def grown(self, history: History, weights, growth, part: int, terms, ends: bool = False) -> list[np.ndarray]:
        """Derivatives of the block means (blocks,) with independent ``weights``, or at the segments' ends, by the growth of
        friction (0) or of drag (1) in the direction of each of ``terms``, one for all or (2, segments)."""
        own = [(p.cells, p.weights(weights[p.name])) for p in self.parts if p.name in GROWING[part]]

        def response(term):
            moved = (_response(cells.grown(growth[part] + GROWTH_STEP * term), history, w, ends) for cells, w in own)
            return sum(moved, np.zeros(()))

        here, *there = (response(term) for term in (0.0, *terms))
        return [(moved - here) / GROWTH_STEP for moved in there]

    def ends(self, history: History, growth=(0.0, 0.0)) -> dict[str, np.ndarray]:
        """The same at the end of every segment."""
        return {p.name: p.mix(_cells(p, growth).ends(history)) for p in self.parts}

    def flank_columns(self, history: History, weights, growth=(0.0, 0.0), ends: bool = False):
        """Even counterparts of the parts at ``weights`` (independent ones by part), (blocks, parts), or at the segments' ends."""
        columns = (_response(_cells(p, growth), history, p.weights(weights[p.name]), ends, sign=-1.0) for p in self.parts)
        return np.stack(list(columns), axis=1)

    def predict(self, history: History, weights, growth=(0.0, 0.0)) -> np.ndarray:
        """Block means (blocks,) at independent ``weights`` by part: columns times weights without making the columns."""
        found = (_cells(p, growth).summed(history, p.weights(weights[p.name])) for p in self.parts)
        return sum(found, np.zeros(()))


def _cells(part, growth) -> Cells:
    grown = [growth[k] for k, names in enumerate(GROWING) if part.name in names]
    return part.cells.grown(grown[0]) if grown else part.cells


def _response(cells, history, weights, ends, sign=1.0):
    """Sum of the cells' responses times ``weights`` (cells,), block means or at the segments' ends."""
    return cells.ends(history, sign=sign) @ weights if ends else cells.summed(history, weights, sign=sign)


def _compliance() -> Part:
    """A constant compliance, about half of the angle scale at the torque scale (the rest is clearance and friction): no friction
    of thresholds too small to be told, which would rest at the tips, need stand for it."""
    cells = Cells(np.zeros(1), np.zeros(1), np.full(1, TOP), np.full(1, 2.0))
    return Part("compliance", "elastic", cells, None, (0.0, 0.0))


def _elastic() -> Part:
    nodes = np.r_[ELASTIC_NODES[:-1], TOP]
    cells = Cells(nodes[:-1], nodes[:-1], np.diff(nodes), np.full(nodes.size - 1, 2.0))
    centre = 0.5 * (nodes[1:] + nodes[:-1])
    return Part("elastic", "elastic", cells, np.linalg.cholesky(np.exp(-_apart(centre) / 0.3)), (float(np.log(0.5)), 1.0))


@lru_cache(maxsize=8)
def _masing(bearings: tuple[float, ...]) -> Part:
    """Friction that is the same at every load, elements in parallel or in series that slip at torques of their own."""
    made = [plays(THRESHOLDS, read_outs=(0.0, 1.0)), *(plays((r,), read_outs=(0.0, 1.0)) for r in bearings)]
    mixing = block_diag(*(principal_components(*one) for one in made))
    return Part("masing", "friction", join(*(cells for cells, _ in made)), mixing, (float(np.log(0.1)), 1.5))


@lru_cache(maxsize=1)
def _friction() -> Part:
    cells, root = plays(THRESHOLDS)
    return Part("friction", "friction", cells, principal_components(cells, root), (float(np.log(0.1)), 1.5))


@lru_cache(maxsize=8)
def _flanks(ratios: tuple[float, ...]) -> tuple[Part, ...]:
    if not ratios:
        return ()
    made = [flank(ratio) for ratio in ratios]
    return (Part("flanks", "friction", join(*(c for c, _ in made)), block_diag(*(m for _, m in made)), FLANK_SCALE),)


def plays(thresholds, read_outs=READ_OUTS) -> tuple[Cells, np.ndarray]:
    """Plays of some thresholds, or of a bearing by itself, and the root of the prior covariance of their weights."""
    share = np.gradient(np.log(thresholds)) / USUAL_SPACING if len(thresholds) > 1 else (1.0 - SHARED,)
    rows = []
    for r, part in zip(thresholds, share, strict=True):
        for low, high in itertools.pairwise(read_outs):
            if low + r < 1:
                high = TOP - r if high + r >= 1 else high
                rows.append((low + r, low - r, high - low, r, 0.5 * (low + high), part))
    up, down, width, threshold, centre, share = np.array(rows).T
    level = _below(threshold, LARGEST_THRESHOLD) if len(read_outs) > 2 else np.ones(threshold.size)
    near = np.exp(-_apart(np.log(threshold)) / 0.7) * (0.5 + 0.5 * np.exp(-_apart(np.sqrt(centre)) / 0.3))
    one = threshold[:, None] == threshold
    # One bearing by itself may slip at any torque.
    near = SHARED * np.outer(share, share) * near + (1.0 - SHARED) * one * np.sqrt(np.outer(share, share)) * near
    root = np.linalg.cholesky(np.outer(level, level) * near + 1e-9 * np.eye(up.size))
    return Cells(up, down, width, np.full(up.size, 2.0)), root


@lru_cache(maxsize=128)
def flank(ratio: float) -> tuple[Cells, np.ndarray]:
    """A flank with Coulomb friction in proportion to its load, which slips back at ``ratio`` of the torque at which it slipped
    forth, (1 - m)/(1 + m) for friction m of the load; and its prior by few weights, (cells, weights)."""
    up, width = FLANK_NODES[:-1], np.diff(FLANK_NODES)
    down = np.minimum(ratio * FLANK_NODES[1:], ratio * up)
    cells = Cells(up, down, width, np.full(width.size, 2.0), abs(ratio) * width)
    near = np.exp(-_apart(np.sqrt(up + 0.5 * width)) / FLANK_ALIKE)
    return cells, principal_components(cells, np.linalg.cholesky(near))


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


def _clearance(knots) -> Part:
    cells = Cells(knots[:-1], -knots[1:], np.diff(knots), 2 * _steps(knots))
    return Part("clearance", "geometric", cells, _neighbouring(knots), (float(np.log(0.02)), 1.5))


def _free_play(knots) -> Part:
    cells = Cells(knots[:-1], knots[:-1], np.diff(knots), _steps(knots))
    return Part("free_play", "geometric", cells, _neighbouring(knots), (float(np.log(0.003)), 1.0))


def _steps(knots) -> np.ndarray:
    """Torques over which a weight's angle is turned, (cells,): what is turned beyond the largest torque is not seen, or the
    loops would bend at their tips."""
    width = np.diff(knots)
    return np.r_[width[:-1], np.max(np.r_[1.0 - knots[-2], width[-2:-1]])]


def _neighbouring(knots) -> np.ndarray:
    """Root of the prior covariance of steps between knots, (cells, cells): teeth that are crossed at about the same torque make
    them alike, and small against the load; one tooth by itself may be crossed anywhere."""
    level = _below(0.5 * (knots[1:] + knots[:-1]), LARGEST_DRAG)
    near = np.exp(-_apart(np.linspace(0.0, 1.0, level.size)) / ALIKE)
    return np.linalg.cholesky(SHARED * np.outer(level, level) * near + (1.0 - SHARED) * np.eye(level.size))


def _below(torque, most: float):
    """Falls from one to nothing where a torque exceeds ``most``: friction and drag are small against the load."""
    return 1.0 / (1.0 + (torque / most) ** 4)


def _apart(values):
    return np.abs(values[:, None] - values)


def place_knots(torques, most: int, least: float) -> np.ndarray:
    """Knots of clearance and free play at quantiles of the blocks' torques |z|, at least ``least`` apart, from 0 to TOP.

    Blocks are short where the angle moves fast, so the knots are dense where the loops are steep; next to zero they are denser.
    """
    wanted = np.quantile(np.abs(torques), np.linspace(0.0, 1.0, most + 1)[1:-TOPMOST])
    knots = spaced(np.r_[0.0, wanted, TOP], least)
    halved = knots[1] * 0.5 ** np.arange(HALVINGS, 0, -1)
    return np.r_[0.0, halved[halved >= least], knots[1:]]


def spaced(knots, least: float) -> np.ndarray:
    """Rising knots thinned to be at least ``least`` apart, ends kept."""
    kept = [float(knots[0])]
    for value in knots[1:-1]:
        if value - kept[-1] >= least:
            kept.append(float(value))
    return np.array([*kept, float(knots[-1])])
