"""fleet.json and pool.json: a fleet of units, and what a batch says of its process."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Count, Curve, Number, Outcome, Probability
from backdrive_bayes.schemas.words import Text


class Chart(Struct):
    """A control chart of an indicator over the units in order: values, centre, sigma, units outside, drift."""

    indicator: Text
    median: Curve
    lo: Curve
    hi: Curve
    centre: Curve
    sigma: Number
    outside: list[str]
    drift: dict[str, Any] | None


class Failure(Struct):
    """A unit without a result."""

    unit: Text
    status: str
    error: str


class FleetFile(Struct, kw_only=True):
    """fleet.json: counts, failures, control charts and the units to look at first."""

    schema: Literal["backdrive-bayes/fleet/1"]
    version: Text
    seed: Count
    options: dict[str, Any]
    outcome: Outcome
    counts: dict[str, Count]
    data_sha256: list[Any]
    failures: list[Failure]
    charts: list[Chart]
    worst: list[dict[str, str]]
    order: str
    loop: dict[str, Any] | None
    charted: list[dict[str, str]]
    false_alarm: Probability
    sigmas: float
    verdicts: dict[str, Count] = field(default_factory=dict)
    effects: dict[str, Count] = field(default_factory=dict)
    same_names: Any = None
    batches: dict[str, Any] | None = None


class PoolFile(Struct, kw_only=True):
    """pool.json: mean and spread of a batch, its next unit, and its units drawn together."""

    schema: Literal["backdrive-bayes/pool/1"]
    quantities: list[dict[str, Any]]
    batch: str = ""
    units: list[str] = field(default_factory=list)
    left_out: list[dict[str, str]] = field(default_factory=list)
    data_sha256: list[Any] = field(default_factory=list)
    rated_torque_Nm: Number = None
    k: Probability = 0.03
    level: Probability = 0.9
    seed: Count = 0
    most_bits: Number = None
    version: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    outcome: Outcome | None = None
