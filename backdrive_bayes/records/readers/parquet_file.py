"""Reader of Parquet tables."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows, finite_columns


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen columns; rows are counted from 1, the bound on rows is checked before any is read."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise MissingExtra("reading Parquet", "pyarrow", "readers") from error
    try:
        with pyarrow.parquet.ParquetFile(path, memory_map=True) as file:
            check_rows(path, file.metadata.num_rows)
            wanted = list(choose(tuple(file.schema_arrow.names)))
            table = file.read(columns=wanted)
            arrays = [table.column(name).to_numpy() for name in wanted]
    except (pyarrow.ArrowException, OSError) as error:
        raise BadInput(path, "a Parquet table", str(error)[:120]) from error
    return finite_columns(path, wanted, arrays, "row")
