"""The stages of long verbs with their typical times, and how far along a run is by them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

EARLIEST_LEFT_S = 3.0
"""Seconds before which no time left is told: it would be a guess from nothing."""
MOST_OF_A_STAGE = 0.95
"""Share of its typical time at which a stage that takes longer waits."""


@dataclass(frozen=True)
class Stage:
    """A stage that begins with a note that holds ``said``; ``typical_s`` is its time for a unit of seven records."""

    said: str
    typical_s: float


# Seconds of reducer-1 and reducer-2 on one quiet core; only their ratios matter, a run tells its own speed.
_PREPARED = (Stage("reducing the records", 1.0), Stage("finding the mode", 4.5))
_WEIGHED = Stage("weighing effects", 5.0)
_SAMPLED = Stage("evaluations", 2.0)
_TOLD = Stage("indicators and their intervals", 2.5)
_KEPT = (Stage("saving the posterior", 2.0), Stage("figures", 3.0))
FIT = (*_PREPARED, _WEIGHED, _SAMPLED, _TOLD)
FIT_KEPT = (*FIT, *_KEPT)
_LOCATED = (*_PREPARED, _WEIGHED, Stage("where it lies", 2.0))
DIAGNOSE = (*_LOCATED, Stage("sampling the chosen model", 2.0), _SAMPLED, _TOLD, *_KEPT)
_SIMULATOR = (
    Stage("simulator: reducing", 0.5), Stage("simulator: finding", 5.0), Stage("simulator: sampling", 10.0),
    Stage("splitting the gap", 3.0),
)  # fmt: skip
DIAGNOSE_SIMULATED = (*_LOCATED, Stage("sampling the chosen model", 2.0), _SAMPLED, *_SIMULATOR, _TOLD, *_KEPT)
ACCEPT = (*FIT, *_LOCATED, *_KEPT)


class Clock:
    """How far a run is: by the share that it is told, else by the stages that it has gone through, each only once."""

    def __init__(self, stages: tuple[Stage, ...], now: Callable[[], float]):
        self._stages, self._now, self._began = stages, now, now()
        self._at, self._entered = -1, self._began
        self._told: float | None = None
        self.text = ""

    def note(self, text: str, share: float | None = None) -> None:
        """What is being done, and the share of the work that is done where it is known."""
        self.text, self._told = text, share
        ahead = range(self._at + 1, len(self._stages))
        reached = next((i for i in ahead if self._stages[i].said in text), None)
        if reached is not None:
            self._at, self._entered = reached, self._now()

    @property
    def passed_s(self) -> float:
        """Seconds since the beginning."""
        return self._now() - self._began

    @property
    def share(self) -> float | None:
        """Share of the work that is done, None where nothing tells it."""
        if self._told is not None:
            return min(max(self._told, 0.0), 1.0)
        if self._at < 0:
            return None
        return self._done_s() / sum(s.typical_s for s in self._stages)

    @property
    def left_s(self) -> float | None:
        """Seconds that are left at the speed so far, None where it is too early to tell."""
        share, passed = self.share, self.passed_s
        if not share or passed < EARLIEST_LEFT_S:
            return None
        return passed * (1.0 - share) / share

    def _done_s(self) -> float:
        """Typical seconds of what is done; within a stage time runs at the speed of those before it."""
        before = sum(s.typical_s for s in self._stages[: self._at])
        speed = before / (self._entered - self._began) if before and self._entered > self._began else 1.0
        typical = self._stages[self._at].typical_s
        return before + min(speed * (self._now() - self._entered), MOST_OF_A_STAGE * typical)
