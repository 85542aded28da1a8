"""verdict.json: a unit against its limits, with the risks of the decision."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Convergence, MaybeProbability, Number, Probability, Result
from backdrive_bayes.schemas.words import Text

Word = Literal["accepted", "rejected", "inconclusive"]


class JudgedLimit(Struct):
    """A limit at one loop: the indicator's posterior, the probability that the limit is kept, and its verdict."""

    indicator: Text
    unit: str
    loading_rate_Nm_per_s: Number
    amplitude_Nm: Number
    min: Number
    max: Number
    median: Number
    lo: Number
    hi: Number
    conformance_probability: MaybeProbability
    verdict: Word
    sd: Number = None
    predicted: bool = False
    monte_carlo_error: Number = None
    specific_consumer_risk: MaybeProbability = None
    specific_producer_risk: MaybeProbability = None
    guard_band: dict[str, Number] | None = None
    accept_median_between: list[Number] = field(default_factory=list)


class Risks(Struct):
    """The agreed risks."""

    consumer: Probability
    producer: Probability


class Structure(Struct):
    """What a diagnosis says of the models behind the verdict: those at hand, and what is in none of them."""

    diagnosed: bool
    models: list[dict[str, Any]]
    uncovered: dict[str, Probability]
    unknown_probability: Probability


class VerdictFile(Result, kw_only=True):
    """All of it; ``next`` is what to measure where the verdict is open."""

    schema: Literal["backdrive-bayes/verdict/1"]
    unit: Text
    verdict: Word
    reason: str
    risk: Risks
    conformance_probability: MaybeProbability
    limits: list[JudgedLimit]
    structure: Structure
    convergence: Convergence
    limiting: dict[str, Any] | None = None
    next: dict[str, Any] | None = None
    specific_consumer_risk: MaybeProbability = None
    specific_producer_risk: MaybeProbability = None
    k: Probability = 0.03
    level: Probability = 0.9
    rated_torque_Nm: Number = None
    posterior_sha256: str = ""
    identity: dict[str, str] = field(default_factory=dict)
    reproduction: dict[str, Any] = field(default_factory=dict)
