"""unit.toml: a unit and its records."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field

from backdrive_bayes.schemas.words import Positive, Text

UNIT = "backdrive-bayes/unit/1"


class ColumnsTable(Struct, forbid_unknown_fields=True, frozen=True):
    """``[record.columns]``: a bench's own column names with their units."""

    time: Text | None = None
    torque: Text | None = None
    angle: Text | None = None

    def given(self) -> dict[str, str]:
        """The columns that are named."""
        named = {"time": self.time, "torque": self.torque, "angle": self.angle}
        return {kind: name for kind, name in named.items() if name is not None}


class RecordTable(Struct, frozen=True):
    """``[[record]]``: one file and what is declared of it."""

    file: Text
    loading_rate_Nm_per_s: Positive | None = None
    amplitude_Nm: Positive | None = None
    columns: ColumnsTable = field(default_factory=ColumnsTable)


class UnitFile(Struct, frozen=True):
    """The keys with a meaning; any other text, number or date is kept as the unit's identity."""

    schema: Literal["backdrive-bayes/unit/1"]
    name: Text
    rated_torque_Nm: Positive
    record: Annotated[list[RecordTable], Meta(min_length=1, title="at least one [[record]] table")]
    reduction_ratio: Positive | None = None
