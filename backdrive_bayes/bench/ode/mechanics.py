"""The bench "ode": a chain of nodes with bristle friction and power-law contact across clearance, integrated in time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from backdrive_bayes.bench.ode import drawing, registry, turning
from backdrive_bayes.bench.ode.record import record_angle
from backdrive_bayes.bench.ode.reducer import OdeReducer
from backdrive_bayes.bench.protocol import Circumstances, DrawEffect


@dataclass(frozen=True)
class OdeMechanics:
    """Mechanics of the bench "ode"; see :class:`backdrive_bayes.bench.protocol.Mechanics`."""

    name: str = "ode"
    kinds: tuple[str, ...] = tuple(drawing.KINDS)

    @property
    def effects(self) -> Mapping[str, DrawEffect]:
        """Listed effects: name -> draw(rng, reducer)."""
        return registry.EFFECTS

    @property
    def unlisted(self) -> Mapping[str, DrawEffect]:
        """Effects that no library lists: name -> draw(rng, reducer)."""
        return registry.UNLISTED

    def draw_reducer(self, rng, kind: str | None = None, without: tuple[str, ...] = ()) -> OdeReducer:
        """A clean reducer at random, without the named members."""
        return drawing.draw_reducer(rng, kind, without)

    def angle(self, reducer, effects, where: Circumstances, time_s):
        """Noise-free angle [rad] as read at ``time_s``, shape (samples,)."""
        return record_angle(reducer, effects, where, time_s)

    def turned(self, reducer: OdeReducer, held: tuple[str, ...] = ()):
        """The reducer with each parameter in turn moved by a small step, except those of the ``held`` members."""
        return turning.turned(reducer, held)


MECHANICS = OdeMechanics()
