"""The engine bench: a gear train simulated by MuJoCo, a rigid-body engine that others wrote."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.bench.engine import reducer as reducers
from backdrive_bayes.bench.engine.clock import make_steps
from backdrive_bayes.bench.engine.effect import EngineEffect, Run
from backdrive_bayes.bench.engine.reducer import EngineReducer
from backdrive_bayes.bench.engine.registry import EFFECTS, UNLISTED
from backdrive_bayes.bench.engine.rows import load_engine
from backdrive_bayes.bench.engine.simulate import train_angle
from backdrive_bayes.bench.protocol import Circumstances, DrawEffect


@dataclass(frozen=True)
class EngineMechanics:
    """Implements :class:`backdrive_bayes.bench.protocol.Mechanics`; ``refine`` multiplies the engine's steps."""

    name: str = "mujoco"
    kinds: tuple[str, ...] = reducers.KINDS
    effects: Mapping[str, DrawEffect] = field(default_factory=lambda: dict(EFFECTS))
    unlisted: Mapping[str, DrawEffect] = field(default_factory=lambda: dict(UNLISTED))
    refine: float = 1.0

    def draw_reducer(self, rng, kind: str | None = None, without: tuple[str, ...] = ()) -> EngineReducer:
        """A clean reducer at random; raises MissingExtra where the engine is not installed."""
        load_engine()
        return reducers.draw_reducer(rng, kind, without)

    def angle(self, reducer: EngineReducer, effects: tuple[EngineEffect, ...], where: Circumstances, time_s) -> np.ndarray:
        """Angle [rad] as read at ``time_s`` [s], shape (samples,); what has strength 0 is absent."""
        effects = tuple(e for e in effects if e.strength != 0.0)
        steps = make_steps(where.path, reducer.rated_torque_nm, self.refine)
        run, load, train = Run(reducer, where, steps), steps.load, reducer.train()
        for effect in effects:
            load, train = effect.load(run, load), effect.train(run, train)
        angle = reducer.angle_rad * train_angle(train, load, steps.step_s, where.floating)
        for effect in effects:
            angle = angle + effect.series(run, load)
        for effect in effects:
            angle = effect.transmit(run, angle)
        reading = np.interp(time_s, steps.time_s, angle)
        for effect in effects:
            reading = effect.read(run, np.asarray(time_s), reading)
        return reading


MECHANICS = EngineMechanics()
