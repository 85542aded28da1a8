"""The unit file of a unit folder: read and judged key by key."""

from __future__ import annotations

import datetime
import difflib
import math
from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.toml_file import read_toml

SCHEMA = "backdrive-bayes/unit/1"
FILE_NAME = "unit.toml"
_UNIT_KEYS = ("schema", "name", "rated_torque_Nm", "reduction_ratio", "record")
_RECORD_KEYS = ("file", "loading_rate_Nm_per_s", "amplitude_Nm", "columns")
_COLUMN_KEYS = ("time", "torque", "angle")


@dataclass(frozen=True)
class RecordEntry:
    """One ``[[record]]`` of a unit file: the file's checked path and what is declared of it."""

    path: Path
    name: str
    columns: dict[str, str] = field(default_factory=dict)
    loading_rate_nm_per_s: float | None = None
    amplitude_nm: float | None = None


@dataclass(frozen=True)
class UnitEntry:
    """A unit file's content; torques in N·m."""

    name: str
    rated_torque_nm: float
    records: tuple[RecordEntry, ...]
    reduction_ratio: float | None = None
    identity: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def read_unit_toml(folder: Path) -> UnitEntry:
    """Read ``unit.toml`` in ``folder``; BadInput names the key, what was expected and what was found."""
    path = folder / FILE_NAME
    table = read_toml(path, "a unit file", "a folder without one" if folder.is_dir() else "nothing there")
    schema = _text(path, table, "schema")
    if schema != SCHEMA:
        raise BadInput(f"{path}, key schema", f"'{SCHEMA}'", f"'{schema}'")
    identity, notes = _extras(path, table)
    return UnitEntry(
        name=_text(path, table, "name"),
        rated_torque_nm=_positive(path, table, "rated_torque_Nm", required=True),
        records=_records(path, folder, table),
        reduction_ratio=_positive(path, table, "reduction_ratio"),
        identity=identity,
        notes=notes,
    )


def _records(path: Path, folder: Path, table: dict) -> tuple[RecordEntry, ...]:
    entries = table.get("record")
    if not isinstance(entries, list) or not entries or not all(isinstance(entry, dict) for entry in entries):
        raise BadInput(
            f"{path}, key record", "at least one [[record]] table", _shown(entries, table, "record")
        )
    records = tuple(_record(path, folder, entry, number) for number, entry in enumerate(entries, start=1))
    seen: dict[Path, int] = {}
    for number, record in enumerate(records, start=1):
        first = seen.setdefault(record.path.resolve(), number)
        if first != number:
            raise BadInput(
                f"{path}, record {number}, key file", "each file once", f"'{record.name}' of record {first}"
            )
    return records


def _record(path: Path, folder: Path, entry: dict, number: int) -> RecordEntry:
    where = f"{path}, record {number}"
    _refuse_misspelt(where, entry, _RECORD_KEYS)
    name = _text(where, entry, "file")
    return RecordEntry(
        path=_inside(where, folder, name),
        name=name,
        columns=_columns(where, entry.get("columns", {})),
        loading_rate_nm_per_s=_positive(where, entry, "loading_rate_Nm_per_s"),
        amplitude_nm=_positive(where, entry, "amplitude_Nm"),
    )


def _inside(where: str, folder: Path, name: str) -> Path:
    """Path of a record file, which must stay inside the unit folder, symbolic links followed."""
    relative = Path(name)
    if relative.is_absolute() or PureWindowsPath(name).is_absolute() or ".." in PureWindowsPath(name).parts:
        raise BadInput(f"{where}, key file", "a path inside the unit folder", f"'{name}'")
    try:
        target = (folder / relative).resolve()
        if not target.is_relative_to(folder.resolve()):
            raise BadInput(
                f"{where}, key file", "a path inside the unit folder", f"'{name}', a link that leaves it"
            )
        if not target.exists():
            raise BadInput(f"{where}, key file", f"a file '{name}' in the unit folder", "nothing there")
    except BadInput:
        raise
    except (OSError, ValueError, RuntimeError) as error:
        raise BadInput(f"{where}, key file", "a path that can be read", f"'{name}': {error}") from error
    return folder / relative


def _columns(where: str, columns) -> dict[str, str]:
    if not isinstance(columns, dict):
        raise BadInput(f"{where}, key columns", "a table of time, torque and angle", f"{columns!r}")
    for key in columns:
        if key not in _COLUMN_KEYS:
            raise BadInput(
                f"{where}, key columns.{key}",
                f"one of {', '.join(_COLUMN_KEYS)}",
                f"'{key}'{_nearest(key, _COLUMN_KEYS)}",
            )
    return {key: _text(f"{where}, columns", columns, key) for key in columns}


def _extras(path: Path, table: dict) -> tuple[dict[str, str], tuple[str, ...]]:
    """Free text of the unit file, and notes on keys that mean nothing here."""
    _refuse_misspelt(str(path), table, _UNIT_KEYS)
    identity, notes = {}, []
    for key, value in table.items():
        if key in _UNIT_KEYS:
            continue
        if isinstance(value, str | int | float | datetime.date | datetime.time) and not isinstance(
            value, bool
        ):
            identity[key] = str(value)
        else:
            notes.append(f"key '{key}' of {FILE_NAME} is not text and was left out")
    return identity, tuple(notes)


def _refuse_misspelt(where: str, table: dict, known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known and (near := _nearest(key, [name for name in known if name not in table])):
            raise BadInput(f"{where}, key {key}", f"one of {', '.join(known)}", f"'{key}'{near}")


def _nearest(key: str, known) -> str:
    near = [name for name in known if name.casefold() == key.casefold()]
    near = near or difflib.get_close_matches(key, known, n=1, cutoff=0.8)
    return f" (did you mean {near[0]}?)" if near else ""


def _text(where, table: dict, key: str) -> str:
    value = table.get(key)
    if not isinstance(value, str) or not value.strip():
        raise BadInput(f"{where}, key {key}", "text", _shown(value, table, key))
    return value


def _positive(where, table: dict, key: str, required: bool = False) -> float | None:
    if key not in table and not required:
        return None
    value = table.get(key)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not 0.0 < value < 1e300 or not math.isfinite(value):
        raise BadInput(f"{where}, key {key}", "a positive number", _shown(value, table, key))
    return float(value)


def _shown(value, table: dict, key: str) -> str:
    return repr(value)[:60] if key in table else "no such key"
