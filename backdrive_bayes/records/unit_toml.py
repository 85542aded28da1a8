"""The unit file of a unit folder as reading uses it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PureWindowsPath

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.toml_file import read_toml
from backdrive_bayes.schemas.typed import nearest, typed
from backdrive_bayes.schemas.unit_file import RecordTable, UnitFile

FILE_NAME = "unit.toml"


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
    _refuse_misspelt(str(path), table, UnitFile.__struct_fields__)
    file = typed(table, UnitFile, path)
    for number, entry in enumerate(table["record"], 1):
        _refuse_misspelt(f"{path}, record {number}", entry, RecordTable.__struct_fields__)
    identity, notes = _extras(table)
    records = tuple(_record(f"{path}, record {i}", folder, entry) for i, entry in enumerate(file.record, 1))
    _refuse_twice(path, records)
    return UnitEntry(file.name, file.rated_torque_Nm, records, file.reduction_ratio, identity, notes)


def _refuse_twice(path: Path, records: tuple[RecordEntry, ...]) -> None:
    seen: dict[Path, int] = {}
    for number, record in enumerate(records, start=1):
        first = seen.setdefault(record.path.resolve(), number)
        if first != number:
            raise BadInput(f"{path}, record {number}, key file", "each file once", f"'{record.name}' of record {first}")


def _record(where: str, folder: Path, entry: RecordTable) -> RecordEntry:
    path = _inside(where, folder, entry.file)
    return RecordEntry(path, entry.file, entry.columns.given(), entry.loading_rate_Nm_per_s, entry.amplitude_Nm)


def _inside(where: str, folder: Path, name: str) -> Path:
    """Path of a record file, which must stay inside the unit folder, symbolic links followed."""
    relative = Path(name)
    if relative.is_absolute() or PureWindowsPath(name).is_absolute() or ".." in PureWindowsPath(name).parts:
        raise BadInput(f"{where}, key file", "a path inside the unit folder", f"'{name}'")
    try:
        target = (folder / relative).resolve()
        if not target.is_relative_to(folder.resolve()):
            raise BadInput(f"{where}, key file", "a path inside the unit folder", f"'{name}', a link that leaves it")
        if not target.exists():
            raise BadInput(f"{where}, key file", f"a file '{name}' in the unit folder", "nothing there")
    except BadInput:
        raise
    except (OSError, ValueError, RuntimeError) as error:
        raise BadInput(f"{where}, key file", "a path that can be read", f"'{name}': {error}") from error
    return folder / relative


def _extras(table: dict) -> tuple[dict[str, str], tuple[str, ...]]:
    """Free text of the unit file, and notes on keys that mean nothing here."""
    extras = {key: value for key, value in table.items() if key not in UnitFile.__struct_fields__}
    told = {key for key, value in extras.items() if isinstance(value, str | int | float) and not isinstance(value, bool)}
    notes = tuple(f"key '{key}' of {FILE_NAME} is not text and was left out" for key in extras if key not in told)
    return {key: str(value) for key, value in extras.items() if key in told}, notes


def _refuse_misspelt(where: str, table: dict, known: tuple[str, ...]) -> None:
    for key in table:
        if key not in known and (near := nearest(key, [name for name in known if name not in table], 0.8)):
            raise BadInput(f"{where}, key {key}", f"one of {', '.join(known)}", f"'{key}'{near}")
