"""The contact bench's mechanics: bodies in series, gapped nonlinear contacts, friction as energy minimisation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backdrive_bayes.bench.contact.drawing import KINDS, draw_reducer
from backdrive_bayes.bench.contact.effect import ContactEffect, Run, Test
from backdrive_bayes.bench.contact.reducer import ContactReducer
from backdrive_bayes.bench.contact.registry import EFFECTS, UNLISTED
from backdrive_bayes.bench.contact.solver import STEP, follow
from backdrive_bayes.bench.protocol import Circumstances, DrawEffect

LOAD_STEP = 0.006
"""Largest step of the torque, as a share of T_r."""


class ContactMechanics:
    """Mechanics of the protocol; see bench/protocol.py."""

    name = "contact"
    kinds: tuple[str, ...] = tuple(KINDS)
    effects: Mapping[str, DrawEffect] = EFFECTS
    unlisted: Mapping[str, DrawEffect] = UNLISTED

    def draw_reducer(self, rng, kind: str | None = None, without: tuple[str, ...] = ()) -> ContactReducer:
        """A clean reducer at random."""
        return draw_reducer(rng, kind, without)

    def angle(self, reducer: ContactReducer, effects: tuple[ContactEffect, ...], where: Circumstances, time_s) -> np.ndarray:
        """Noise-free angle [rad] as the channel reads it at rising times ``time_s`` >= 0, shape (samples,)."""
        test = Test(reducer, where)
        run = run_chain(test, effects)
        reading = np.interp(time_s, run.time_s, run.angle) + sum((e.late(test, run, time_s) for e in effects), 0.0)
        for effect in effects:
            reading = effect.read(test, time_s, reading)
        return reducer.angle_rad * reading


def run_chain(test: Test, effects=(), load_step: float = LOAD_STEP, largest_step: float = STEP) -> Run:
    """Answer of the chain and of what stands in series with it, past included."""
    reducer, chain = test.reducer, test.reducer.chain()
    for effect in effects:
        chain = effect.chain(test, chain)
    # Beyond 1 a flank would lock for good; so strong a friction of single flanks is a tail of their scatter.
    chain = chain._replace(mu=np.minimum(chain.mu, 0.9))
    times = load_grid(test, effects, load_step)
    load = test.where.path.torque_at(times) / reducer.rated_torque_nm
    for effect in effects:
        load = effect.load(test, times, load)
    rows = follow(chain, times, load, reducer.floating_angles(test.where.floating), largest_step)
    time, load = rows[:, 0], np.interp(rows[:, 0], times, load)
    run = Run(time, load, rows[:, 1] + reducer.shaft_share * load, rows[:, 2:])
    return Run(time, load, run.angle + sum((e.deflect(test, run) for e in effects), 0.0), run.mesh)


def load_grid(test: Test, effects, load_step: float) -> np.ndarray:
    """Times [s] of the path's turning points, of what effects ask for, and between them in small steps of the torque."""
    path = test.where.path
    extra = [e.times_s(test) for e in effects]
    turning = np.unique(np.concatenate([path.time_s, *extra]))
    turning = turning[(turning >= path.time_s[0]) & (turning <= path.time_s[-1])]
    change = np.abs(np.diff(path.torque_at(turning))) / (load_step * test.reducer.rated_torque_nm)
    pieces = np.maximum(np.ceil(change - 1e-9), 1).astype(int)
    parts = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(turning[:-1], turning[1:], pieces, strict=True)]
    return np.concatenate([*parts, turning[-1:]])


MECHANICS = ContactMechanics()
