"""The Parquet tables of a fleet, a row a unit and a row a record, compacted from the units' result files."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.fleet.store import CannotKeep, read_stored, result_path, write_whole
from backdrive_bayes.fleet.units import FleetUnit
from backdrive_bayes.indicators.same_loop import same_amplitude

NAME, RECORDS = "fleet.parquet", "records.parquet"
ROWS = 2048
"""Rows of one group: a few megabytes in memory."""


def rows_of(out: Path, unit: FleetUnit) -> list[dict]:
    """Rows of a unit: one a record, one with its error where it has none, and none where it has no result."""
    found = read_stored(out, unit)
    if found is None:
        return []
    about = {key: found[key] for key in ("unit", "status", "error", "version", "seed")}
    about |= {"result": result_path(out, unit).relative_to(out).as_posix()}
    return [about | row for row in found["rows"] or [{}]]


def compact(out: Path, units: list[FleetUnit]) -> int:
    """Write the tables of all results in ``out``, each in one step, in order of the units; returns the number of units in them.

    A unit's row is that of its largest loop, of several as large that of the slowest. Raises BadInput where one cannot be
    written.
    """
    _write(Path(out) / RECORDS, lambda: (row for unit in units for row in rows_of(out, unit)))
    return _write(Path(out) / NAME, lambda: (_of_unit(rows) for unit in units if (rows := rows_of(out, unit))))


def _of_unit(rows: list[dict]) -> dict:
    """The row of a unit, and how many records it has."""
    records = [row for row in rows if row.get("amplitude_Nm")]
    largest = max((row["amplitude_Nm"] for row in records), default=0.0)
    wide = [row for row in records if same_amplitude(row["amplitude_Nm"], largest)]
    return min(wide, key=lambda row: row["loading_rate_Nm_per_s"], default=rows[0]) | {"records": len(records)}


def _write(path: Path, rows: Callable[[], Iterator[dict]]) -> int:
    pa, parquet = require_pyarrow()
    kinds: dict[str, str] = {}
    for row in rows():
        for name, value in row.items():
            kinds[name] = _wider(kinds.get(name, "null"), value)
    types = {"null": pa.float64(), "bool": pa.bool_(), "int": pa.int64(), "float": pa.float64(), "str": pa.string()}
    # A column that is empty in this fleet has the type that its name tells in every other.
    schema = pa.schema([(n, pa.string() if kind == "null" and n in TEXT else types[kind]) for n, kind in kinds.items()])
    count, buffer = 0, io.BytesIO()
    with parquet.ParquetWriter(buffer, schema, compression="zstd") as writer:
        left = rows()
        while some := list(islice(left, ROWS)):
            writer.write_table(pa.Table.from_pylist(some, schema=schema))
            count += len(some)
    try:
        write_whole(path, buffer.getvalue())
    except CannotKeep as error:
        raise BadInput(path, "room for the table", f"{error}; results of units are kept") from None
    return count


TEXT = ("error", "serial", "batch", "test_date", "file", "effects", "answer", "credible_set_90", "verdict", "reason", "limiting")
_ORDER = ("null", "bool", "int", "float", "str")


def _wider(kind, value):
    own = "null" if value is None else type(value).__name__
    return max(kind, own, key=_ORDER.index)


def require_pyarrow():
    """pyarrow and its Parquet module; MissingExtra where it is not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtra("a fleet's table", "pyarrow", "fleet") from None
    return pyarrow, parquet
