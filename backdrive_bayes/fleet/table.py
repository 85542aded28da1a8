"""The Parquet tables of a fleet, a row a unit and a row a record, compacted from the units' result files."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.fleet.store import CannotKeep, read_stored, result_path, write_whole
from backdrive_bayes.fleet.units import FleetUnit
from backdrive_bayes.indicators.same_loop import same_amplitude

NAME, RECORDS = "fleet.parquet", "records.parquet"
UNITS_AT_ONCE = 1024
"""Units of one group of rows: a few megabytes in memory."""


def rows_of(out: Path, unit: FleetUnit) -> list[dict]:
    """Rows of a unit: one a record, one with its error where it has none, and none where it has no result."""
    found = read_stored(out, unit)
    if found is None:
        return []
    about = {key: found[key] for key in ("unit", "status", "error", "version", "seed")}
    about |= {"result": result_path(out, unit).relative_to(out).as_posix()}
    return [about | row for row in found["rows"] or [{}]]


def compact(out: Path, units: list[FleetUnit]) -> int:
    """Write both tables of all results in ``out``, each in one step, in order of the units; returns the number of units in them.

    A unit's row is that of its largest loop, of several as large that of the slowest. Raises BadInput where one cannot be
    written.
    """
    pa, parquet = require_pyarrow()
    kinds: dict[str, str] = {}
    for rows in _all(out, units):
        for row in rows:
            for name, value in row.items():
                kinds[name] = _wider(kinds.get(name, "null"), value)
    types = {"null": pa.float64(), "bool": pa.bool_(), "int": pa.int64(), "float": pa.float64(), "str": pa.string()}
    # A column that is empty in this fleet has the type that its name tells in every other.
    schema = pa.schema([(n, pa.string() if kind == "null" and n in TEXT else types[kind]) for n, kind in kinds.items()])
    count, left, buffers = 0, _all(out, units), (io.BytesIO(), io.BytesIO())
    of_unit = schema.append(pa.field("records", pa.int64()))
    with (
        parquet.ParquetWriter(buffers[0], schema, compression="zstd") as records,
        parquet.ParquetWriter(buffers[1], of_unit, compression="zstd") as whole,
    ):
        while some := list(islice(left, UNITS_AT_ONCE)):
            records.write_table(pa.Table.from_pylist(list(chain.from_iterable(some)), schema=schema))
            whole.write_table(pa.Table.from_pylist([_of_unit(rows) for rows in some], schema=of_unit))
            count += len(some)
    for name, buffer in zip((RECORDS, NAME), buffers, strict=True):
        try:
            write_whole(Path(out) / name, buffer.getvalue())
        except CannotKeep as error:
            raise BadInput(Path(out) / name, "room for the table", f"{error}; results of units are kept") from None
    return count


def _of_unit(rows: list[dict]) -> dict:
    """The row of a unit, and how many records it has."""
    records = [row for row in rows if row.get("amplitude_Nm")]
    largest = max((row["amplitude_Nm"] for row in records), default=0.0)
    wide = [row for row in records if same_amplitude(row["amplitude_Nm"], largest)]
    return min(wide, key=lambda row: row["loading_rate_Nm_per_s"], default=rows[0]) | {"records": len(records)}


def _all(out, units) -> Iterator[list[dict]]:
    return (rows for unit in units if (rows := rows_of(out, unit)))


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
