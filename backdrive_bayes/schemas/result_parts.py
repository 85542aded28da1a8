"""What all result files share."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct, field

from backdrive_bayes.schemas.words import Text

Number = Annotated[float | None, Meta(title="a number, or null where there is none")]
Probability = Annotated[float, Meta(ge=-1e-9, le=1.0 + 1e-9, title="a probability")]
MaybeProbability = Annotated[Probability | None, Meta(title="a probability, or null where there is none")]
Count = Annotated[int, Meta(ge=0, title="a whole number from 0")]
Digest = Annotated[str, Meta(pattern=r"^[0-9a-f]{64}$", title="a SHA-256 of 64 hexadecimal digits")]
Curve = Annotated[list[float | None], Meta(title="a list of numbers")]
Branch = Literal["load+", "unload+", "load-", "unload-"]


class Interval(Struct):
    """Median and bounds of the central interval at the file's ``level``."""

    median: Number
    lo: Number
    hi: Number


class Outcome(Struct):
    """How a result came out: what exit code, screen, file and report all say."""

    word: Text
    exit_code: Literal[0, 2, 3, 4]
    reason: str = ""
    caveat: str = ""


class Finding(Struct):
    """What the check found in the data."""

    level: Literal["error", "warning", "note"]
    text: str
    record: str | None = None


class Convergence(Struct):
    """Diagnostics of the sampling: worst values over parameters and indicators, and what to do where they fail."""

    converged: bool
    max_rhat: Number = None
    min_bulk_ess: Number = None
    min_tail_ess: Number = None
    evaluations: Count = 0
    worst: str = ""
    advice: str = ""
    contradictions: list[str] = field(default_factory=list)


class Model(Struct):
    """Modules and effects of the model that was fitted."""

    modules: list[str]
    effects: list[str]


class Result(Struct, kw_only=True):
    """What a result rests on (data, version, seed, options), and how it came out."""

    data_sha256: list[Digest]
    version: Text
    seed: Count
    options: dict[str, Any]
    outcome: Outcome
    unit_sha256: str = ""
    findings: list[Finding] = field(default_factory=list)
    forced: bool = False
