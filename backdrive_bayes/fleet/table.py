"""The Parquet table of a fleet, a row a unit and record, compacted from the units' result files."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.fleet.store import CannotKeep, read_stored, result_path, write_whole
from backdrive_bayes.fleet.units import FleetUnit

NAME = "fleet.parquet"
ROWS = 2048
"""Rows of one group: a few megabytes in memory."""


def rows_of(out: Path, unit: FleetUnit) -> list[dict]:
    """The table's rows of a unit: one a record, one with its error where it has none, and none where it has no result."""
    found = read_stored(out, unit)
    if found is None:
        return []
    about = {key: found[key] for key in ("unit", "status", "error", "version", "seed")}
    about |= {"result": result_path(out, unit).relative_to(out).as_posix()}
    return [about | row for row in found["rows"] or [{}]]


def compact(out: Path, units: list[FleetUnit]) -> int:
    """Write the table of all results in ``out`` in one step, in order of the units; returns the number of rows.

    Raises BadInput where it cannot be written.
    """
    pa, parquet = require_pyarrow()
    kinds: dict[str, str] = {}
    for row in _all(out, units):
        for name, value in row.items():
            kinds[name] = _wider(kinds.get(name, "null"), value)
    types = {"null": pa.float64(), "bool": pa.bool_(), "int": pa.int64(), "float": pa.float64(), "str": pa.string()}
    # A column that is empty in this fleet has the type that its name tells in every other.
    schema = pa.schema([(n, pa.string() if kind == "null" and n in TEXT else types[kind]) for n, kind in kinds.items()])
    count, buffer = 0, io.BytesIO()
    with parquet.ParquetWriter(buffer, schema, compression="zstd") as writer:
        left = _all(out, units)
        while rows := list(islice(left, ROWS)):
            writer.write_table(pa.Table.from_pylist(rows, schema=schema))
            count += len(rows)
    try:
        write_whole(Path(out) / NAME, buffer.getvalue())
    except CannotKeep as error:
        raise BadInput(Path(out) / NAME, "room for the table", f"{error}; results of units are kept") from None
    return count


TEXT = ("error", "serial", "batch", "test_date", "file", "effects", "answer", "credible_set_90", "verdict", "reason", "limiting")
_ORDER = ("null", "bool", "int", "float", "str")


def _wider(kind, value):
    own = "null" if value is None else type(value).__name__
    return max(kind, own, key=_ORDER.index)


def _all(out, units) -> Iterator[dict]:
    return (row for unit in units for row in rows_of(out, unit))


def require_pyarrow():
    """pyarrow and its Parquet module; MissingExtra where it is not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingExtra("a fleet's table", "pyarrow", "fleet") from None
    return pyarrow, parquet
