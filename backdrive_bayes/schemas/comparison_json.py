"""comparison.json: units beside each other, and answers to claims."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Interval, MaybeProbability, Number, Probability, Result
from backdrive_bayes.schemas.words import Text


class Contrast(Struct):
    """One indicator of two units at one loop."""

    first: Interval
    second: Interval
    difference: Interval
    ratio: Interval | None
    verdict: Literal["greater", "less", "equivalent", "undecided", "inconclusive"]
    unit: str = "1"
    probability_first_greater: MaybeProbability = None
    probability_equivalent: MaybeProbability = None
    probability_clearly_greater: MaybeProbability = None
    probability_clearly_less: MaybeProbability = None


class Condition(Struct):
    """A loading rate and an amplitude that two units have in common."""

    loading_rate_Nm_per_s: float
    amplitude_Nm: float
    indicators: dict[str, Contrast]
    predicted: list[Any] = field(default_factory=list)
    not_compared: dict[str, str] = field(default_factory=dict)


class Pair(Struct):
    """Two units, and the loops that cannot be compared with the reason."""

    first: Text
    second: Text
    conditions: list[Condition]
    refused: list[dict[str, Any]] = field(default_factory=list)


class AnsweredClaim(Struct):
    """A claim with its probability and answer."""

    id: int | str
    claim: str
    probability: MaybeProbability
    verdict: Literal["holds", "does not hold", "open", "not answered", "inconclusive"]
    asked: str = ""
    reason: str = ""
    note: str = ""
    numbers: list[Any] = field(default_factory=list)


class Claims(Struct):
    """The claims that were asked and the thresholds of their answers."""

    claims: list[AnsweredClaim]
    source: str = ""
    units: dict[str, str | None] = field(default_factory=dict)
    holds_from: Probability = 0.95
    fails_below: Probability = 0.05


class ComparisonFile(Result, kw_only=True):
    """All of it; ``units`` are the indicators objects of the units in the order of ``names``."""

    schema: Literal["backdrive-bayes/comparison/1"]
    names: list[Text]
    level: Probability
    rope: Number
    converged: bool
    pairs: list[Pair]
    claims: Claims | None
    units: list[dict[str, Any]]
    clear: Probability = 0.95
    overlays: list[dict[str, Any]] = field(default_factory=list)
    mechanism: list[dict[str, Any]] = field(default_factory=list)
    reproduction: list[dict[str, Any]] = field(default_factory=list)
