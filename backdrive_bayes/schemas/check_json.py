"""check.json: what the records of a unit hold and whether inference may go on."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Branch, Count, Number, Result
from backdrive_bayes.schemas.words import Text


class FoundBranch(Struct):
    """A monotone run of the torque."""

    branch: Branch
    cycle: Count
    start: Count
    samples: Count
    torque_lo_Nm: float
    torque_hi_Nm: float


class FoundAndDeclared(Struct):
    """A value as found in the data and as the unit file declares it."""

    estimated: Number
    declared: Number


class CheckedRecord(Struct):
    """One record: samples, branches, cycles, closure, noise and the measured loop."""

    record: Text
    samples: Count
    duration_s: float
    branches: list[FoundBranch]
    cycles: Count
    amplitude_Nm: FoundAndDeclared
    loading_rate_Nm_per_s: FoundAndDeclared
    noise: dict[str, Number]
    closure: dict[str, Any] | None
    measured_loop: dict[str, Any] | None = None
    gaps: list[Any] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class CheckFile(Result, kw_only=True):
    """All of it; ``may_infer`` is false where an error speaks against inference, and ``reason`` says which."""

    schema: Literal["backdrive-bayes/check/1"]
    unit: Text
    rated_torque_Nm: float
    records: list[CheckedRecord]
    may_infer: bool
    reason: str
    reduction_ratio: Number = None
    identity: dict[str, str] = field(default_factory=dict)
    messages: list[dict[str, str]] = field(default_factory=list)
