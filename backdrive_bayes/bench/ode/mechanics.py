"""The bench "ode": a chain of nodes with bristle friction and power-law contact across clearance, integrated in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from backdrive_bayes.bench.ode import drawing, registry
from backdrive_bayes.bench.ode.chain import make_chain
from backdrive_bayes.bench.ode.effect import Run
from backdrive_bayes.bench.ode.integrate import TOLERANCE, follow
from backdrive_bayes.bench.ode.reducer import OdeReducer
from backdrive_bayes.bench.plan import Path
from backdrive_bayes.bench.protocol import Circumstances, DrawEffect

BASE_TORQUE, BASE_STEP_S = 0.01, 0.25
"""Largest spacing of the base points: a share of the rated torque, and a time so that slow changes are followed."""


@dataclass(frozen=True)
class OdeMechanics:
    """Implements :class:`backdrive_bayes.bench.protocol.Mechanics`; ``tolerance`` is that of the integration."""

    name: str = "ode"
    kinds: tuple[str, ...] = tuple(drawing.KINDS)
    effects: Mapping[str, DrawEffect] = field(default_factory=lambda: registry.EFFECTS)
    unlisted: Mapping[str, DrawEffect] = field(default_factory=lambda: registry.UNLISTED)
    tolerance: float = TOLERANCE

    def draw_reducer(self, rng, kind: str | None = None, without: tuple[str, ...] = ()) -> OdeReducer:
        """A clean reducer at random, without the named members."""
        return drawing.draw_reducer(rng, kind, without)

    def angle(self, reducer, effects, where: Circumstances, time_s):
        """Noise-free angle [rad] as read at ``time_s``, shape (samples,)."""
        run, effects = Run(reducer, where), [e for e in effects if e.strength != 0.0]
        angle = np.interp(time_s, *channel_angle(run, effects, self.tolerance))
        for effect in effects:
            angle = effect.read(run, time_s, angle)
        return angle * reducer.angle_rad


MECHANICS = OdeMechanics()


def channel_angle(run: Run, effects, tolerance: float):
    """Times [s] and angle before the reading, in angle scales, two arrays of shape (steps,)."""
    base = base_times(run.where.path, run.reducer.rated_torque_nm)
    torque = run.load(base)
    for effect in effects:
        torque = effect.torque(run, base, torque)
    parts = [_chain_angle(run, effects, base, torque, tolerance)]
    parts += [part for part in (effect.series(run, base, torque) for effect in effects) if part is not None]
    time = parts[0][0] if len(parts) == 1 else np.unique(np.concatenate([times for times, _ in parts]))
    angle = sum(np.interp(time, *part) for part in parts)
    for effect in effects:
        angle = effect.mesh(run, time, np.interp(time, base, torque), angle)
    for effect in effects:
        time, angle = effect.respond(run, time, angle)
    return time, angle


def base_times(path: Path, rated_torque_nm: float):
    """Times [s] between which the acting torque is straight: turning points and even steps between them."""
    pieces = [path.time_s[:1]]
    for begin, end, low, high in zip(path.time_s[:-1], path.time_s[1:], path.torque_nm[:-1], path.torque_nm[1:], strict=True):
        steps = max(abs(high - low) / (BASE_TORQUE * rated_torque_nm), (end - begin) / BASE_STEP_S, 1.0)
        pieces.append(np.linspace(begin, end, int(np.ceil(steps - 1e-9)) + 1)[1:])
    return np.concatenate(pieces)


def _chain_angle(run, effects, base, torque, tolerance):
    chain, widen, rub = make_chain(run.reducer), np.zeros_like(base), np.ones_like(base)
    for effect in effects:
        chain = effect.alter(run, chain)
        widen = widen + effect.widen(run, base)
        rub = rub * effect.rub(run, base)
    return follow(chain, base, torque, widen, rub, run.where.floating, tolerance)
