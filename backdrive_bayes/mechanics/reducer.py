"""The class of clean reducers: odd, rate-independent hysteresis operators, linear in their weights.

Seven parts share the Preisach plane: a constant compliance, smooth elasticity beside it, friction of three kinds (plays that are
the same at every load; plays whose read-out changes with it; flanks, whose friction is in proportion to it), clearance (relays
that cross at +a and back at -a, each tooth at its own a) and free play (steps without drag).
Clearance and free play are refined where the loops are steep; together they hold any odd settled loop at the resolution of their
knots.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from scipy.special import ndtr

from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.cells import Cells
from backdrive_bayes.mechanics.clearance import clearance, free_play
from backdrive_bayes.mechanics.effect import MOST_GROWTH
from backdrive_bayes.mechanics.friction import FRICTION, flanks, friction, masing
from backdrive_bayes.mechanics.history import History
from backdrive_bayes.mechanics.part import TOP, Part, apart

ELASTIC_NODES = (0.0, 0.015, 0.04, 0.08, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95, 1.0)
EVERY = ("compliance", "elastic", *FRICTION, "clearance", "free_play")
GROWING = (FRICTION, ("clearance",), EVERY)
"""Parts whose thresholds follow the rate and the amplitude: of friction, and drags; and those behind a drag at the shaft."""
GROWING_MODULES = ("friction", "geometric")
"""Modules of the first two of them."""
SHIFTS = np.r_[0.0, ndtr(0.75 * np.arange(-3, 4)), 1.0]
"""Quantiles of the draws' growths at which responses are made, those between are interpolated: of normal ones the inner quantiles
are three quarters of a standard deviation apart, so that the ends of an interval, too, lie between near ones."""
UNGROWN = (0.0, 0.0, 0.0)
"""Growth where nothing grows."""
GROWTH_STEPS = (2e-3, 2e-3, 2e-5)
"""Steps of the difference quotients by the growth of the thresholds of friction and of drags, and by a drag before all parts."""
BASELINE = ("geometric", "elastic", "friction")


@dataclass(frozen=True, eq=False)
class ReducerClass:
    """Parts of the class with clearance knots ``knots`` (rising from 0 to TOP) and flanks that slip back at ``ratios`` of the
    torque at which they slipped forth."""

    knots: np.ndarray
    modules: tuple[str, ...] = BASELINE
    ratios: np.ndarray = field(default_factory=lambda: np.empty(0))
    parts: tuple[Part, ...] = field(init=False)

    def __post_init__(self):
        unknown = [m for m in self.modules if m not in BASELINE]
        if unknown or "elastic" not in self.modules:
            raise BadInput("--baseline", f"modules out of {', '.join(BASELINE)}, elastic among them", ",".join(self.modules))
        own = (flanks(tuple(self.ratios.tolist())),) if self.ratios.size else ()
        made = (_compliance(), _elastic(), masing(), friction(), *own, clearance(self.knots), free_play(self.knots))
        object.__setattr__(self, "parts", tuple(p for p in made if p.module in self.modules))

    def part(self, name: str) -> Part:
        """A part by name; its module must not be left out."""
        return next(p for p in self.parts if p.name == name)

    def columns(self, history: History, growth=UNGROWN) -> dict[str, np.ndarray]:
        """Block means of every part's columns, (blocks, weights) by name.

        Friction and drag thresholds are multiplied by the exponentials of the first two of ``growth``, the third is the drag of a
        play before all parts; each is either the same everywhere or (2, segments).
        """
        return {p.name: p.mix(_cells(p, growth).means(history)) for p in self.parts}

    def grown(self, history: History, weights, growth, part: int, terms, here=None) -> list[np.ndarray]:
        """Derivatives of the block means (blocks,) with independent ``weights`` by the growth of friction (0) or of drag (1), or
        by the drag before all parts (2), in the direction of each of ``terms``, one for all or (2, segments). What the parts that
        grow make as they are may be known, ``here``."""
        own, step = [p for p in self.parts if p.name in GROWING[part]], GROWTH_STEPS[part]

        def response(term):
            grown = tuple(g + step * term if k == part else g for k, g in enumerate(growth))
            moved = (_cells(p, grown).summed(history, p.weights(weights[p.name])) for p in own)
            return sum(moved, np.zeros(()))

        here = response(0.0) if here is None else here
        return [(response(term) - here) / step for term in terms]

    def shifted(self, history: History, weights, growth, part: int, shifts, term=1.0) -> np.ndarray:
        """What growths of friction (0), of drag (1) or of the drag before all parts (2) by each of ``shifts`` (draws,) times
        ``term``, one for all or (2, segments), add at the segments' ends, (draws, segments), with independent ``weights``:
        straight from response to response at quantiles of the shifts, for where a step is crossed no derivative leads far. No
        drag helps the motion."""
        own, most = [p for p in self.parts if p.name in GROWING[part]], MOST_GROWTH / max(float(np.abs(term).max()), 1e-300)
        shifts, least = np.clip(shifts, -most, most), 0.0 if part == len(GROWING) - 1 else -np.inf

        def response(shift):
            grown = tuple(np.maximum(g + shift * term, least) if k == part else g for k, g in enumerate(growth))
            ends = (_cells(p, grown).ends(history) @ p.weights(weights[p.name]) for p in own)
            return sum(ends, np.zeros(history.z1.size))

        nodes = np.unique(np.r_[0.0, np.quantile(shifts, SHIFTS)])
        between = np.stack([np.interp(shifts, nodes, share) for share in np.eye(nodes.size)], axis=1)
        return between @ (np.stack([response(node) for node in nodes]) - response(0.0))

    def ends(self, history: History, growth=UNGROWN) -> dict[str, np.ndarray]:
        """The same at the end of every segment."""
        return {p.name: p.mix(_cells(p, growth).ends(history)) for p in self.parts}

    def along(self, history: History, weights, growth=UNGROWN) -> tuple[np.ndarray, np.ndarray]:
        """Means on the segments and values at their ends, two of (segments,), at independent ``weights`` by part."""
        count = history.z0.size
        each = replace(history, block=np.arange(count), weight=np.ones(count), blocks=count)
        ends = (_cells(p, growth).ends(history) @ p.weights(weights[p.name]) for p in self.parts)
        return self.predict(each, weights, growth), sum(ends, np.zeros(()))

    def flank_columns(self, history: History, weights, growth=UNGROWN, ends: bool = False):
        """Even counterparts of the parts at ``weights`` (independent ones by part), (blocks, parts), or at the segments' ends."""
        parts = ((_cells(p, growth), p.weights(weights[p.name])) for p in self.parts)
        columns = (c.ends(history, sign=-1.0) @ w if ends else c.summed(history, w, sign=-1.0) for c, w in parts)
        return np.stack(list(columns), axis=1)

    def predict(self, history: History, weights, growth=UNGROWN) -> np.ndarray:
        """Block means (blocks,) at independent ``weights`` by part: columns times weights without making the columns."""
        found = (_cells(p, growth).summed(history, p.weights(weights[p.name])) for p in self.parts)
        return sum(found, np.zeros(()))


def _cells(part, growth) -> Cells:
    friction, drag, before = growth
    own = friction if part.name in GROWING[0] else drag if part.name in GROWING[1] else 0.0
    return part.cells.grown(own, before) if np.ndim(own) or np.ndim(before) else _steady(part, own, before)


@lru_cache(maxsize=1024)
def _steady(part, own: float, before: float) -> Cells:
    """Cells that grow alike all along a history: those of a mode are wanted for every record and derivative."""
    return part.cells.grown(own, before)


def _compliance() -> Part:
    """A constant compliance, about half of the angle scale at the torque scale (the rest is clearance and friction): no friction
    of thresholds too small to be told, which would rest at the tips, need stand for it."""
    cells = Cells(np.zeros(1), np.zeros(1), np.full(1, TOP), np.full(1, 2.0))
    return Part("compliance", "elastic", cells, None, (0.0, 0.0))


def _elastic() -> Part:
    nodes = np.r_[ELASTIC_NODES[:-1], TOP]
    cells = Cells(nodes[:-1], nodes[:-1], np.diff(nodes), np.full(nodes.size - 1, 2.0))
    centre = 0.5 * (nodes[1:] + nodes[:-1])
    return Part("elastic", "elastic", cells, np.linalg.cholesky(np.exp(-apart(centre) / 0.3)), (float(np.log(0.5)), 1.0))
