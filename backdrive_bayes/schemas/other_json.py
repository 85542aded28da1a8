"""prediction.json, blind.json, run.json: what a prediction rests on, the scores of a blind check, how long a verb took."""

from __future__ import annotations

from typing import Any, Literal

from msgspec import Struct, field

from backdrive_bayes.schemas.result_parts import Count, Digest, Number, Probability, Result
from backdrive_bayes.schemas.words import Text


class History(Struct):
    """The torque history that was predicted."""

    file: Text
    sha256: Digest


class PredictionFile(Result, kw_only=True):
    """prediction.json, beside prediction.csv: what it rests on.

    ``notes`` say what was guessed or mended in the history, ``caveat`` how far its rate and torque are from those measured;
    ``prediction_sha256`` is of the curve.
    """

    schema: Literal["backdrive-bayes/prediction/1"]
    unit: Text
    reason: str
    history: History
    posterior_sha256: Digest
    prediction_sha256: Digest
    notes: list[str] = field(default_factory=list)
    caveat: str = ""


class Mark(Struct):
    """A mark that a diagnosis is held to; ``met`` is null where nothing could be scored."""

    mark: str
    met: bool | None
    found: Number
    least: Number
    most: Number


class BlindUnit(Struct):
    """A unit of a blind check: what was planted and what was answered."""

    unit: Text
    truth: Any
    answer: Any
    credible_set_90: list[str] = field(default_factory=list)
    gap_probability: Number = None
    error: str | None = None


class BlindFile(Result, kw_only=True):
    """blind.json: answers against the opened key."""

    schema: Literal["backdrive-bayes/blind/1"]
    key_sha256: Digest
    request: dict[str, Any]
    marks: list[Mark]
    counts: dict[str, Count]
    units: list[BlindUnit]
    failures: list[dict[str, Any]] = field(default_factory=list)
    interval_level: Probability = 0.95


class RunFile(Struct):
    """run.json: how long the last verb took on what machine; no result depends on it."""

    schema: Literal["backdrive-bayes/run/1"]
    verb: Text
    seconds: float
    machine: dict[str, Any]
