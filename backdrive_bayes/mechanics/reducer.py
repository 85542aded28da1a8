"""The class of clean reducers: odd, rate-independent hysteresis operators, linear in their weights.

Four parts share the Preisach plane: smooth elasticity, friction (play operators over thresholds and read-outs), clearance
(relays that cross at +a and back at -a, each tooth at its own a) and free play (steps without drag). Clearance and free play are
refined where the loops are steep; together they hold any odd settled loop at the resolution of their knots.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.cells import Cells
from backdrive_bayes.mechanics.history import History

TOP = 1.2
"""Torque up to which cells reach, in the unit's largest: an offset of the torque channel must not leave the class."""
THRESHOLDS = np.geomspace(0.003, 0.92, 18)
"""Thresholds of friction; a denser grid changes log marginal likelihoods by about 1."""
READ_OUTS = (0.0, 0.04, 0.12, 0.28, 0.5, 0.75, 0.9, 1.0)
"""Nodes of friction's read-outs; they must reach the largest torque, or clean loops seem to slip."""
ELASTIC_NODES = (0.0, 0.015, 0.04, 0.08, 0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 0.95, 1.0)
INITIAL_THRESHOLDS = (0.01, 0.04, 0.12, 0.3, 0.6)
"""Thresholds at which a record's friction may have been left anywhere."""
ZONES = 12
"""Groups of clearance relays whose first state is free in each record."""
HALVINGS = 4
"""How often the interval of knots next to zero is halved: the width at zero torque is that of a point, block means are not."""
BASELINE = ("geometric", "elastic", "friction")


@dataclass(frozen=True, eq=False)
class Part:
    """One part of the class: its cells, and ``mixing`` (cells, cells) that turns independent weights into the prior's.

    ``log_scale`` is mean and standard deviation of the normal prior on the log standard deviation of the weights, in
    shares of the
    angle scale.
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
    """Parts of the class with clearance knots ``knots`` (rising from 0 to TOP)."""

    knots: np.ndarray
    modules: tuple[str, ...] = BASELINE
    parts: tuple[Part, ...] = field(init=False)

    def __post_init__(self):
        unknown = [m for m in self.modules if m not in BASELINE]
        if unknown or "elastic" not in self.modules:
            raise BadInput("--baseline", f"modules out of {', '.join(BASELINE)}, elastic among them", ",".join(self.modules))
        made = (_elastic(), _friction(), _clearance(self.knots), _free_play(self.knots))
        object.__setattr__(self, "parts", tuple(p for p in made if p.module in self.modules))

    def part(self, name: str) -> Part:
        """A part by name; its module must not be left out."""
        return next(p for p in self.parts if p.name == name)

    def has(self, name: str) -> bool:
        """Whether the class holds a part of this name."""
        return any(p.name == name for p in self.parts)

    def columns(self, history: History, exponents=(0.0, 0.0), log_rate: float = 0.0) -> dict[str, np.ndarray]:
        """Block means of every part's columns, (blocks, weights) by name.

        Friction and drag thresholds are multiplied by exp(exponent · log_rate).
        """
        return {p.name: p.mix(self._cells(p, exponents, log_rate).means(history)) for p in self.parts}

    def ends(self, history: History, exponents=(0.0, 0.0), log_rate: float = 0.0) -> dict[str, np.ndarray]:
        """The same at the end of every segment."""
        return {p.name: p.mix(self._cells(p, exponents, log_rate).ends(history)) for p in self.parts}

    def flank_columns(self, history: History, weights, exponents=(0.0, 0.0), log_rate: float = 0.0, ends: bool = False):
        """Even counterparts of the parts at ``weights`` (independent ones by part), (blocks, parts), or at the segments' ends."""
        columns = []
        for part in self.parts:
            cells = self._cells(part, exponents, log_rate)
            even = cells.ends(history, sign=-1.0) if ends else cells.means(history, sign=-1.0)
            columns.append(even @ part.weights(weights[part.name]))
        return np.stack(columns, axis=1)

    def initial_columns(self, history: History, clearance_weights=None, exponents=(0.0, 0.0), log_rate: float = 0.0):
        """What a record's unknown initial state adds: columns of friction left up or down, and of clearance zones left up.

        ``clearance_weights`` (cells,) are the present weights of the clearance, that a zone's state moves.
        """
        found = {}
        if self.has("friction"):
            plays = [Cells(*(np.array([v]) for v in (r - TOP, -r - TOP, 2 * TOP, 2.0))) for r in INITIAL_THRESHOLDS]
            neutral, upper, lower = (np.hstack([p.means(history, s) for p in plays]) for s in ("neutral", "upper", "lower"))
            found["initial"] = np.hstack([upper - neutral, lower - neutral])
        if self.has("clearance"):
            part = self.part("clearance")
            cells = self._cells(part, exponents, log_rate)
            moved = cells.means(history, "upper") - cells.means(history)
            weights = (
                np.abs(clearance_weights) if clearance_weights is not None else np.full(cells.count, np.exp(part.log_scale[0]))
            )
            total = np.cumsum(weights)
            zone = np.minimum(ZONES * (total - 0.5 * weights) / max(total[-1], 1e-300), ZONES - 1e-9).astype(int)
            found["floating"] = np.stack([moved[:, zone == k] @ weights[zone == k] for k in range(ZONES)], axis=1)
        return found

    def _cells(self, part, exponents, log_rate):
        if part.name == "friction" and exponents[0] * log_rate:
            return part.cells.wider(float(np.exp(exponents[0] * log_rate)))
        if part.name == "clearance" and exponents[1] * log_rate:
            return part.cells.wider(float(np.exp(exponents[1] * log_rate)))
        return part.cells


def _elastic() -> Part:
    nodes = np.r_[ELASTIC_NODES[:-1], TOP]
    cells = Cells(nodes[:-1], nodes[:-1], np.diff(nodes), np.full(nodes.size - 1, 2.0))
    centre = 0.5 * (nodes[1:] + nodes[:-1])
    return Part("elastic", "elastic", cells, np.linalg.cholesky(np.exp(-_apart(centre) / 0.3)), (float(np.log(0.5)), 1.0))


def _friction() -> Part:
    rows = []
    for r in THRESHOLDS:
        for low, high in zip(READ_OUTS[:-1], READ_OUTS[1:], strict=True):
            if low + r < 1:
                high = TOP - r if high + r >= 1 else high
                rows.append((low + r, low - r, high - low, r, 0.5 * (low + high)))
    up, down, width, threshold, centre = np.array(rows).T
    level = 1.0 / (1.0 + (threshold / 0.3) ** 4)
    near = np.exp(-_apart(np.log(threshold)) / 0.7) * (0.5 + 0.5 * np.exp(-_apart(np.sqrt(centre)) / 0.3))
    mixing = np.linalg.cholesky(np.outer(level, level) * near + 1e-9 * np.eye(up.size))
    return Part("friction", "friction", Cells(up, down, width, np.full(up.size, 2.0)), mixing, (float(np.log(0.1)), 1.5))


def _clearance(knots) -> Part:
    width = np.diff(knots)
    return Part("clearance", "geometric", Cells(knots[:-1], -knots[1:], width, 2 * width), None, (float(np.log(0.02)), 1.5))


def _free_play(knots) -> Part:
    width = np.diff(knots)
    return Part("free_play", "geometric", Cells(knots[:-1], knots[:-1], width, width), None, (float(np.log(0.003)), 1.0))


def _apart(values):
    return np.abs(values[:, None] - values)


def place_knots(torques, most: int, least: float) -> np.ndarray:
    """Knots of clearance and free play at quantiles of the blocks' torques |z|, at least ``least`` apart, from 0 to TOP.

    Blocks are short where the angle moves fast, so the knots are dense where the loops are steep; next to zero they are denser.
    """
    wanted = np.quantile(np.abs(torques), np.linspace(0.0, 1.0, most + 1))
    knots = spaced(np.r_[0.0, wanted[1:], TOP], least)
    halved = knots[1] * 0.5 ** np.arange(HALVINGS, 0, -1)
    return np.r_[0.0, halved[halved >= least], knots[1:]]


def spaced(knots, least: float) -> np.ndarray:
    """Rising knots thinned to be at least ``least`` apart, ends kept."""
    kept = [float(knots[0])]
    for value in knots[1:-1]:
        if value - kept[-1] >= least:
            kept.append(float(value))
    return np.array([*kept, float(knots[-1])])
