"""Columns of a unit: the class and the effects, at a distortion and a set of knots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from backdrive_bayes.engine.marginal import Scales
from backdrive_bayes.engine.reduced import BlockMeans
from backdrive_bayes.mechanics.effect import (
    AngleEffect,
    Distortion,
    Effect,
    FlankEffect,
    GrowthEffect,
    PathEffect,
    SpreadEffect,
    TangentEffect,
)
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS
from backdrive_bayes.mechanics.history import LEAST_RANGE, History, behind, of_blocks
from backdrive_bayes.mechanics.reducer import GROWING, ReducerClass

UNDISTORTED = Distortion()
STEP = 2e-5
"""Step of the difference quotients by offset and lag."""


@dataclass(frozen=True, eq=False)
class Group:
    """Columns that share a scale: one array (blocks, weights) a record; ``own`` where each record has weights of its own."""

    name: str
    columns: tuple[np.ndarray, ...]
    own: bool = False

    @property
    def width(self) -> int:
        """Number of weights."""
        return sum(c.shape[1] for c in self.columns) if self.own else self.columns[0].shape[1]

    def of_record(self, record: int) -> np.ndarray:
        """Columns of all weights at one record's blocks, zero for other records' own weights."""
        if not self.own:
            return self.columns[record]
        rows = self.columns[record].shape[0]
        return np.hstack([c if r == record else np.zeros((rows, c.shape[1])) for r, c in enumerate(self.columns)])

    def by_record(self) -> tuple[Group, ...]:
        """One group for the own weights of each record, by name and number."""
        records = range(len(self.columns))
        parts = (tuple(c if k == r else c[:, :0] for k, c in enumerate(self.columns)) for r in records)
        return tuple(Group(f"{self.name}_{r}", part, own=True) for r, part in zip(records, parts, strict=True))


@dataclass(frozen=True, eq=False)
class Design:
    """Groups of columns side by side."""

    groups: tuple[Group, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the groups in order."""
        return tuple(g.name for g in self.groups)

    def group(self, name: str) -> Group:
        """A group by name."""
        return self.groups[self.names.index(name)]

    @property
    def index(self) -> np.ndarray:
        """Number of the group of every weight."""
        return np.repeat(np.arange(len(self.groups)), [g.width for g in self.groups])

    def records(self) -> list[np.ndarray]:
        """All columns of each record."""
        return [np.hstack([g.of_record(r) for g in self.groups]) for r in range(len(self.groups[0].columns))]

    def split(self, weights) -> dict[str, np.ndarray]:
        """Weights (weights, …) by group."""
        ends = np.cumsum([g.width for g in self.groups])
        return dict(zip(self.names, np.split(weights, ends[:-1]), strict=True))

    def predict(self, weights: Mapping[str, np.ndarray], names=None) -> list[np.ndarray]:
        """Sum of the named groups' columns times their weights at each record's blocks, of all that have weights by default."""
        used = [g for g in self.groups if g.name in (weights if names is None else names)]
        return [sum(g.of_record(r) @ weights[g.name] for g in used) for r in range(len(self.groups[0].columns))]

    def scales(self, priors: Mapping[str, tuple[float, float]]) -> Scales:
        """Scales of the weights with (mean, sd) of each group's log scale."""
        table = np.array([priors[n] for n in self.names], float).reshape(-1, 2)
        return Scales(self.index, table[:, 0], table[:, 1])

    def joined(self, *groups: Group) -> Design:
        """This design with more groups."""
        return Design(self.groups + groups)


_as_read = lru_cache(maxsize=128)(of_blocks)


@lru_cache(maxsize=128)
def _history(blocks, torque_scale_nm: float, offset: float, lag_s: float) -> History:
    """Histories of the distortions about a mode are wanted again and again; those of two offsets differ by these alone."""
    return _as_read(blocks, torque_scale_nm, lag_s).beside(offset)


def histories(reduced: BlockMeans, distortion: Distortion) -> list[History]:
    """Torque histories of all records as the reducer felt them."""
    return [_history(b, reduced.torque_scale_nm, distortion.offset, distortion.lag_s) for b in reduced.blocks]


def grown_histories(reduced: BlockMeans, distortion: Distortion) -> list[tuple[History, tuple]]:
    """The same, each with the growth of thresholds along it."""
    rates = zip(histories(reduced, distortion), reduced.context.log_rate, strict=True)
    return [(history, distortion.growth(rate + history.surge, history.log_amplitude, reduced.context)) for history, rate in rates]


def class_groups(reduced: BlockMeans, reducer: ReducerClass, distortion: Distortion) -> Design:
    """Columns of the class at a distortion."""
    found: dict[str, list] = {}
    for history, growth in grown_histories(reduced, distortion):
        for name, column in reducer.columns(history, growth).items():
            found.setdefault(name, []).append(column)
    return Design(tuple(Group(n, tuple(c)) for n, c in found.items()))


def class_prediction(reduced: BlockMeans, reducer: ReducerClass, distortion: Distortion, weights) -> list[np.ndarray]:
    """The same times ``weights`` by group, without the columns."""
    return [reducer.predict(history, weights, growth) for history, growth in grown_histories(reduced, distortion)]


def class_priors(reducer: ReducerClass) -> dict[str, tuple[float, float]]:
    """Normal priors of the class's log scales by group."""
    return {p.name: p.log_scale for p in reducer.parts}


def effect_columns(effect, reducer, history: History, weights, growth, turned, context, record=None, ends=False):
    """Columns of an effect along a history, (blocks, columns) or at the segments' ends; None of one that moves a parameter. The
    class turns by ``turned`` at the ``weights`` of its parts; ``record`` is as for :meth:`PathEffect.responses`."""
    if isinstance(effect, PathEffect):
        responses = effect.responses(history, record, context)
        return responses[1] if ends else history.mean(*responses)
    if isinstance(effect, FlankEffect):
        return reducer.flank_columns(history, weights, growth, ends)
    return effect.columns(turned) if isinstance(effect, AngleEffect) else None


def path_group(reduced: BlockMeans, effect: PathEffect, distortion: Distortion = UNDISTORTED) -> Group:
    """Columns of an effect that follows from the torque history, as the reducer felt it; its prior scale is its own."""
    columns = []
    for r, history in enumerate(histories(reduced, distortion)):
        columns.append(history.mean(*effect.responses(history, r, reduced.context)))
    return Group(effect.name, tuple(columns), effect.per_record)


def tangent_groups(reduced, reducer, design: Design, distortion, known, effects: tuple[Effect, ...]) -> tuple[Group, ...]:
    """Columns made of the class's prediction with its weights, and the share of a lag that smooths, out of ``known`` ones:
    derivatives by the parameter of every tangent effect that can be told, and what follows from the angle."""
    weights = {name: known[name] for name in design.names}
    base, groups, growths = design.predict(weights), [], []
    late: list[np.ndarray] = []
    grown = grown_histories(reduced, distortion)
    for effect in effects:
        if isinstance(effect, AngleEffect | FlankEffect):
            each = zip(grown, base, strict=True)
            columns = (effect_columns(effect, reducer, h, weights, growth, by, reduced.context) for (h, growth), by in each)
            groups.append(Group(effect.name, tuple(columns)))
        if isinstance(effect, SpreadEffect):
            smoothed, growth = _smoothing(reduced, reducer, distortion, weights, base, late)
            share = float(known[effect.name][0]) if effect.name in known else 0.0
            # As much of a longer lag is first-order, a smaller share of it: without a lag nothing is left.
            longer = [more - at / max(distortion.lag_s, STEP) for more, at in zip(growth, smoothed, strict=True)]
            groups[-1] = _columns(groups[-1].name, [by + share * more for by, more in zip(late, longer, strict=True)])
            groups.append(_columns(effect.name, smoothed))
        if effect is BENCH_HYSTERESIS:
            # A lag moves the torque by rate times lag, friction of the bench by the same amount at every rate.
            groups.append(_columns(effect.name, [by / rate for by, rate in zip(late, reduced.context.rate, strict=True)]))
        if isinstance(effect, GrowthEffect):
            growths.append(effect)
        elif isinstance(effect, TangentEffect):
            here = getattr(distortion, effect.parameter)
            # To either side: of a unit upside down, more of it is less.
            ends = (replace(distortion, **{effect.parameter: here + step}) for step in (0.5 * STEP, -0.5 * STEP))
            more, less = (class_prediction(reduced, reducer, end, weights) for end in ends)
            by = [(a - b) / STEP for a, b in zip(more, less, strict=True)]
            late = by if effect.parameter == "lag_s" else late
            groups.append(_columns(effect.name, by))
    for part in range(len(GROWING)):
        groups += _growth_groups(reduced, reducer, design, distortion, grown, weights, [e for e in growths if e.part == part])
    return tuple(groups)


def _growth_groups(reduced, reducer, design, distortion, grown, weights, effects) -> list[Group]:
    """Columns of growths of one kind of thresholds, of those that the rates and amplitudes identify, whatever the distortion."""

    def laws(along):
        rates = zip(reduced.context.log_rate, along, strict=True)
        return [distortion.law(rate + history.surge, history.log_amplitude, reduced.context) for rate, history in rates]

    read = laws(histories(reduced, UNDISTORTED))
    ranges = {e: np.ptp(np.concatenate([np.ravel(law[e.term]) for law in read])) for e in effects}
    # Without its module a class has no thresholds of that kind.
    there = {p.name for p in reducer.parts}
    identified = [e for e, found in ranges.items() if found > LEAST_RANGE and there.intersection(GROWING[e.part])]
    if not identified:
        return []
    part = identified[0].part
    along = zip(grown, laws([history for history, _ in grown]), design.predict(weights, GROWING[part]), strict=True)
    columns = [
        reducer.grown(history, weights, growth, part, [law[e.term] for e in identified], here=here)
        for (history, growth), law, here in along
    ]
    return [_columns(e.name, of) for e, of in zip(identified, zip(*columns, strict=True), strict=True)]


def _columns(name: str, of) -> Group:
    """A group of one column, (blocks,) in each record."""
    return Group(name, tuple(column[:, None] for column in of))


def _smoothing(reduced, reducer, distortion, weights, base, delayed):
    """Prediction behind a first-order lag less that behind a pure delay of the same mean, and its derivative by the mean, one
    array (blocks,) a record each; nothing for a lag below the noise or the step. ``delayed`` is the derivative of the latter."""
    if distortion.lag_s < max(STEP, 0.5 * reduced.context.torque_noise / reduced.context.rate.max()):
        return [np.zeros(b.size) for b in base], [np.zeros(b.size) for b in base]
    found, growth = [], []
    prompt = grown_histories(reduced, replace(distortion, lag_s=0.0))
    for (history, grown), pure, by in zip(prompt, base, delayed, strict=True):
        mean, end = reducer.along(history, weights, grown)
        late, less, more = (
            np.bincount(history.block, history.weight * behind(mean, end, history.t0, history.t1, lag), history.blocks)
            for lag in distortion.lag_s + STEP * np.array([0.0, -0.5, 0.5])
        )
        found.append(late - pure)
        growth.append((more - less) / STEP - by)
    return found, growth
