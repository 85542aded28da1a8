"""A unit's truth and its answer side by side."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from backdrive_bayes.bench.registry import NONE, UNKNOWN
from backdrive_bayes.blind.answers import Answer
from backdrive_bayes.blind.request import PAIR
from backdrive_bayes.errors import BadInput


@dataclass(frozen=True)
class Case:
    """One unit of an opened blind check: its entry of the key and what was answered."""

    entry: dict
    answer: Answer

    @property
    def label(self) -> str:
        """The true label."""
        return self.entry["label"]

    @property
    def klass(self) -> str:
        """The true class: the label, or 'pair' for two."""
        return PAIR if "+" in self.label else self.label

    @property
    def severity(self) -> float | None:
        """Severity as asked for, None for none."""
        return self.entry["severity"]

    @property
    def limited(self) -> bool:
        """Whether an effect falls short of its severity, because more of it would not be physical."""
        return self.entry["limited"]

    @property
    def planted(self) -> list[str]:
        """Names on the bench of what was planted."""
        return [effect["name"] for effect in self.entry["planted"]]

    @property
    def right(self) -> bool:
        """Whether the answer is the truth."""
        return self.answer.label == self.label

    @property
    def covered(self) -> bool:
        """Whether the 90 % set holds the truth."""
        return self.label in self.answer.credible

    @property
    def names_effect(self) -> bool:
        """Whether an effect of the library is named."""
        return self.answer.label not in (None, NONE, UNKNOWN)


def match(key: dict, answers: dict[str, Answer]) -> list[Case]:
    """The units of a key that were answered, in the key's order; BadInput where an answer is to no unit of it."""
    entries = {entry["unit"]: entry for entry in key["units"]}
    strange = [name for name in answers if name not in entries]
    if strange:
        raise BadInput("answers", "answers to units of the key", f"one to {strange[0]}")
    return [Case(entry, answers[name]) for name, entry in entries.items() if name in answers]


def severities(cases: list[Case]) -> list[float]:
    """Severities that occur, highest first."""
    return sorted({c.severity for c in cases if c.severity is not None}, reverse=True)


def by_severity(cases: list[Case], scores: Callable[[list[Case]], dict]) -> list[dict]:
    """Scores of the cases of each severity, highest first."""
    return [{"severity": s, **scores([c for c in cases if c.severity == s])} for s in severities(cases)]
