"""Which row of a text table cannot be used, and why: searched line by line once the fast parser has failed."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.inflate import BoundedStream


def culprit(path: Path, dialect, wanted: list[str]) -> BadInput | None:
    """Search the file for the first row that cannot be used and say what is wrong with it."""
    columns = [(name, dialect.headers.index(name)) for name in wanted]
    empty = None
    with BoundedStream(path) as stream:
        text = io.TextIOWrapper(io.BufferedReader(stream), dialect.encoding, errors="replace", newline="")
        try:
            for row, cells in enumerate(csv.reader(text, delimiter=dialect.separator), start=1):
                if row <= dialect.lines_above:
                    continue
                if not any(cells):
                    empty = empty or row  # harmless at the end of the file
                elif empty:
                    return BadInput(f"{path}, row {empty}", f"{len(dialect.headers)} values", "an empty row")
                elif error := _row_error(path, dialect, columns, row, cells):
                    return error
        except csv.Error as error:
            return BadInput(path, "readable rows", str(error))
    return None


def _row_error(path: Path, dialect, columns, row: int, cells: list[str]) -> BadInput | None:
    where = f"{path}, row {row}"
    if any(cells[len(dialect.headers) :]):
        return too_long(where, dialect.separator, len(dialect.headers), len(cells))
    for name, position in columns:
        cell = cells[position].strip() if position < len(cells) else ""
        if not _is_finite(cell, dialect.decimal):
            mixed = _is_finite(cell, ",") or _is_finite(cell, ".")
            hint = f" (the file's decimal mark is '{dialect.decimal}')" if mixed else ""
            found = f"'{cell[:40]}'{hint}" if cell else "nothing"
            return BadInput(f"{where}, column '{name}'", "a finite number", found)
    return None


def too_long(where: str, separator: str, expected: int, found: int) -> BadInput:
    """The fault of a row with more values than there are names."""
    hint = " (decimal commas with a comma as separator?)" if separator == "," else ""
    return BadInput(where, f"{expected} values", f"{found}{hint}")


def _is_finite(cell: str, decimal: str) -> bool:
    if decimal == ",":
        cell = cell.translate({ord(","): ".", ord("."): ","})
    try:
        return math.isfinite(float(cell)) and "_" not in cell
    except ValueError:
        return False
