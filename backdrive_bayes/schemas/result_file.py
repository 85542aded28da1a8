"""The result files by their schemas, and the reading of one."""

from __future__ import annotations

from typing import Any, get_args, get_type_hints

from backdrive_bayes.schemas.check_json import CheckFile
from backdrive_bayes.schemas.comparison_json import ComparisonFile
from backdrive_bayes.schemas.diagnosis_json import DiagnosisFile
from backdrive_bayes.schemas.fleet_json import FleetFile, PoolFile
from backdrive_bayes.schemas.indicators_json import IndicatorsFile
from backdrive_bayes.schemas.other_json import BlindFile, PredictionFile, RunFile
from backdrive_bayes.schemas.typed import typed
from backdrive_bayes.schemas.verdict_json import VerdictFile

FILES = (
    IndicatorsFile, DiagnosisFile, VerdictFile, ComparisonFile, CheckFile, PredictionFile, BlindFile, FleetFile, PoolFile,
    RunFile,
)  # fmt: skip


def schema_of(shape: type) -> str:
    """The value of ``schema`` in files of a shape."""
    return get_args(get_type_hints(shape)["schema"])[0]


SHAPES = {schema_of(shape): shape for shape in FILES}


def require_whole(value: Any, schema: str, where: object) -> None:
    """BadInput at ``where`` and the key unless a JSON object has every key of its schema with a value of its type."""
    typed(value, SHAPES[schema], where)
