"""What a virtual bench has to bring: its own mechanics. Plans, noise, severities, truth and files are shared by all benches."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np

from backdrive_bayes.bench.plan import Path


@dataclass(frozen=True)
class Circumstances:
    """One record's circumstances.

    ``path`` holds turning torques and times (times before 0 are the reducer's past), ``start_s`` is the record's start since
    switch-on [s], ``index`` its number in the unit, ``floating`` from -1 to 1 says where free parts float at first.
    """

    path: Path
    start_s: float = 0.0
    index: int = 0
    floating: float = 0.0


@dataclass(frozen=True)
class BenchEffect:
    """An effect of the given ``strength`` (its own unit, 0 is absent, the angle grows with it); mechanics give it a meaning.

    ``guess`` is a strength to begin with, ``most`` the largest that is physical; ``of_reducer`` is False where the effect
    is the measuring channel's, so that the reducer's own loop does not have it.
    """

    strength: float = 0.0

    guess = 0.01
    most = 1.0
    of_reducer = True

    def parameters(self) -> dict:
        """Drawn parameters by name, ready for JSON."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {k: v.tolist() if isinstance(v, np.ndarray | np.generic) else v for k, v in values.items()}


DrawEffect = Callable[[np.random.Generator, Any], BenchEffect]
"""draw(rng, reducer) of an effect with strength 0."""


class Mechanics(Protocol):
    """One bench's mechanics.

    A reducer is a frozen dataclass of its own with at least ``rated_torque_nm``, ``angle_rad`` (about half the loop's angle range
    at T_r), ``reduction_ratio``, and ``turned(held=())``: what a fit could re-tune, the reducer with each parameter in turn
    moved by a small physical step (about 2 %), where ``held`` names effects whose like is not to be turned.
    """

    name: str
    """Name on the command line."""
    kinds: tuple[str, ...]
    """Kinds of reducers that it draws."""
    effects: Mapping[str, DrawEffect]
    """Every listed effect of the contract by name, each a mechanism of this bench and not the inference model's formula."""
    unlisted: Mapping[str, DrawEffect]
    """At least five effects that no library lists."""

    def draw_reducer(self, rng: np.random.Generator, kind: str | None = None, without: tuple[str, ...] = ()) -> Any:
        """A clean reducer at random; ``without`` names members it shall lack: load_dependent_friction, hardening_stiffness."""

    def angle(self, reducer, effects: tuple[BenchEffect, ...], where: Circumstances, time_s: np.ndarray) -> np.ndarray:
        """Noise-free angle [rad] as the channel reads it at rising times ``time_s`` >= 0, shape (samples,).

        Deterministic in its arguments. The commanded torque is ``where.path.torque_at(time)``, which is also what an honest
        torque sensor reads.
        """
