"""One record computed: torque, friction, clearance, springs and effects on the event grid, then the angle channel.

The event grid is the record's own; the times asked for join it where the channel reads, so that an answer at one time does not
depend on the other times.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.bench.plan import event_grid
from backdrive_bayes.bench.protocol import Circumstances, DrawEffect
from backdrive_bayes.bench.sliders.effect import Run
from backdrive_bayes.bench.sliders.reducer import KINDS, BenchReducer, draw_reducer
from backdrive_bayes.bench.sliders.registry import EFFECTS, UNLISTED

STEPS_PER_LEG = 300


@dataclass(frozen=True)
class Sliders:
    """Implements :class:`backdrive_bayes.bench.protocol.Mechanics`: sliders, gaps and springs in series."""

    name: str = "sliders"
    kinds: tuple[str, ...] = KINDS
    effects: Mapping[str, DrawEffect] = field(default_factory=lambda: EFFECTS)
    unlisted: Mapping[str, DrawEffect] = field(default_factory=lambda: UNLISTED)

    def draw_reducer(self, rng, kind: str | None = None, without: tuple[str, ...] = ()) -> BenchReducer:
        """A clean reducer at random."""
        return draw_reducer(rng, kind, without)

    def angle(self, reducer: BenchReducer, effects, where: Circumstances, time_s):
        """Noise-free angle [rad] as the channel reads it at rising times ``time_s``, shape (samples,)."""
        grid = event_grid(where.path, reducer.rated_torque_nm, STEPS_PER_LEG)
        angle = reducer_angle(effects, Run.at(reducer, where, grid))
        if not any(_reads(effect) for effect in effects):
            return np.interp(time_s, grid, angle)
        times = np.union1d(grid, time_s)
        reading, run = np.interp(times, grid, angle), Run.at(reducer, where, times)
        for effect in effects:
            reading = effect.read(run, reading)
        return reading[np.searchsorted(times, time_s)]


MECHANICS = Sliders()


def reducer_angle(effects, run: Run):
    """Angle of the reducer and of what is in series with it [rad], at the run's times."""
    reducer, torque = run.reducer, run.torque_nm
    for effect in effects:
        torque = effect.torque(run, torque)
    half_width = reducer.half_widths_nm(torque)
    for effect in effects:
        half_width = effect.friction(run, torque, half_width)
    drag = reducer.drags_nm(torque.size)
    for effect in effects:
        drag = effect.floating_drag(run, drag)
    passed = reducer.transmitted_nm(torque, half_width)
    for effect in effects:
        passed = effect.transmit(run, passed)
    angle = reducer.gap_angle_rad(torque, drag, run.where.floating) + reducer.spring_angle_rad(passed)
    return angle + sum((effect.deflect(run, torque, passed, angle) for effect in effects), 0.0)


def _reads(effect):
    return "read" in vars(type(effect))
