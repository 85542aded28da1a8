"""Read a unit: a folder with ``unit.toml`` and record files, or one bare record file."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.clock import strictly_rising
from backdrive_bayes.records.columns import DEFAULT_COLUMNS, read_channels
from backdrive_bayes.records.faults import SPOILING_SHARE, find_wild
from backdrive_bayes.records.plausible import check_plausible, refuse_short
from backdrive_bayes.records.readers import READERS, record_suffix
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.unit_toml import FILE_NAME, RecordEntry, read_unit_toml
from backdrive_bayes.records.wraps import unwrapped


def read_unit(path: Path | str) -> Unit:
    """Read the unit at ``path``, a unit folder or a record file of any readable format.

    Everything is converted to SI units. Raises BadInput (file, row or key, what was expected, what was found)
    for anything that cannot be a torque-angle record, MissingExtra where a format's reader is not installed.
    """
    path = Path(path)
    if path.name == FILE_NAME and path.is_file():
        path = path.parent
    if path.is_dir():
        return _read_folder(path)
    if not path.exists():
        raise BadInput(path, "a unit folder or a record file", "nothing there")
    return _read_bare(path)


def _read_folder(folder: Path) -> Unit:
    entry = read_unit_toml(folder)
    records = tuple(_read_record(record, entry.rated_torque_nm) for record in entry.records)
    return Unit(
        name=entry.name,
        rated_torque_nm=entry.rated_torque_nm,
        records=records,
        reduction_ratio=entry.reduction_ratio,
        identity=entry.identity,
        notes=entry.notes,
        file_sha256=sha256_of(folder / FILE_NAME),
    )


def _read_bare(path: Path) -> Unit:
    suffix = record_suffix(path)
    if suffix is None:
        raise BadInput(path, f"a unit folder or a file ending in {', '.join(READERS)}", f"'{path.name}'")
    record = _read_record(RecordEntry(path, path.name), None)
    rated = float(np.abs(record.torque_nm[~find_wild(record.torque_nm, SPOILING_SHARE)]).max())
    note = f"no rated torque given: T_r taken as the largest torque, {rated:.4g} N·m"
    return Unit(path.name[: -len(suffix)] or path.name, rated, (record,), notes=(note,))


def _read_record(entry: RecordEntry, rated_torque_nm: float | None) -> Record:
    channels = read_channels(entry.path, DEFAULT_COLUMNS, entry.columns)
    time, torque, angle = channels.values.values()
    refuse_short(time.size, str(entry.path))
    time, clock = strictly_rising(time, channels.first_row, str(entry.path))
    angle, wraps = unwrapped(torque, angle)
    declared = (entry.loading_rate_nm_per_s, entry.amplitude_nm)
    notes = (*channels.notes, *clock, *wraps)
    record = Record(entry.name, time, torque, angle, *declared, notes, channels.spelling, sha256_of(entry.path))
    check_plausible(record, rated_torque_nm, str(entry.path))
    return record


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's bytes, as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
