"""Reader of comma-separated text, plain or compressed."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.inflate import BoundedStream
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows

_HEAD_BYTES = 1 << 16
_CHUNK_ROWS = 500_000
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass(frozen=True)
class _Dialect:
    """How a file is written: text encoding, separator, decimal mark, and the names in its first row."""

    encoding: str
    separator: str
    decimal: str
    headers: tuple[str, ...]
    notes: tuple[str, ...]


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen columns; the header is row 1 and samples start at row 2.

    Separators are comma, semicolon or tab; decimal commas are read where the separator leaves no doubt. Text
    goes through the C parser in bounded chunks; only when that fails is the file searched line by line for
    the culprit.
    """
    dialect = _sniff(path)
    wanted = list(choose(dialect.headers))
    try:
        values, even = _parse(path, dialect, wanted)
    except BadInput:
        raise
    except (
        ValueError,
        OverflowError,
    ) as error:  # the parser's errors are ValueErrors and do not name the row
        fallback = BadInput(path, "columns of finite numbers", str(error))
        raise _culprit(path, dialect, wanted) or fallback from error
    finite = all(np.isfinite(value).all() for value in values)
    error = None if even and finite else _culprit(path, dialect, wanted)
    if error is not None or not finite:
        raise error or BadInput(path, "columns of finite numbers", "a value that is not")
    return Columns(tuple(values), first_row=2, notes=dialect.notes)


def _parse(path: Path, dialect: _Dialect, wanted: list[str]) -> tuple[list[np.ndarray], bool]:
    """Columns, and whether the separators in the file are as many as rows of equal length need.

    The parser drops surplus fields in silence; a decimal comma would shift the columns unseen.
    """
    import pandas  # imported here: it costs a quarter of a second that --help need not pay

    positions = [dialect.headers.index(name) for name in wanted]
    options = dict(
        sep=dialect.separator,
        decimal=dialect.decimal,
        encoding=dialect.encoding,
        header=None,
        skiprows=1,
        usecols=sorted(set(positions)),
        dtype=np.float64,
        engine="c",
        skip_blank_lines=False,
        chunksize=_CHUNK_ROWS,
    )
    chunks: list[list[np.ndarray]] = []
    mark = dialect.separator.encode()
    with BoundedStream(path, mark) as stream, pandas.read_csv(stream, **options) as frames:
        for frame in frames:
            chunks.append([frame[position].to_numpy() for position in positions])
            check_rows(path, sum(len(chunk[0]) for chunk in chunks))
    if not chunks:
        raise BadInput(path, "samples below the header", "none")
    values = _without_trailing_blanks([np.concatenate(parts) for parts in zip(*chunks, strict=True)])
    needed = (len(dialect.headers) - 1) * (len(values[0]) + 1)
    return values, stream.seen == needed


def _without_trailing_blanks(values: list[np.ndarray]) -> list[np.ndarray]:
    if not all(np.isnan(value[-1]) for value in values):
        return values
    filled = np.flatnonzero(~np.all([np.isnan(value) for value in values], axis=0))
    return [value[: filled[-1] + 1 if filled.size else 0] for value in values]


def _sniff(path: Path) -> _Dialect:
    with BoundedStream(path) as stream:
        head = io.BufferedReader(stream, _HEAD_BYTES).read(_HEAD_BYTES)
    encoding, notes = _encoding(path, head)
    lines = [line for line in head.decode(encoding, errors="replace").splitlines() if line]
    if len(lines) < 2:
        raise BadInput(path, "a header and samples", f"{len(lines)} line{'s'[: len(lines) != 1]}")
    if len(head) == _HEAD_BYTES:
        lines.pop()
    if len(lines) < 2:
        raise BadInput(path, "lines of text", f"a first line longer than {_HEAD_BYTES} bytes")
    separator = max(",;\t", key=lines[0].count)
    headers = tuple(name.strip() for name in next(csv.reader([lines[0]], delimiter=separator)))
    if separator not in lines[0]:
        raise BadInput(f"{path}, row 1", "columns separated by comma, semicolon or tab", f"'{lines[0][:60]}'")
    first = next(csv.reader([lines[1]], delimiter=separator))
    if any(first[len(headers) :]):
        raise _too_long(f"{path}, row 2", separator, len(headers), len(first))
    body = "".join(lines[1:])
    decimal = "," if separator != "," and body.count(",") > body.count(".") else "."
    return _Dialect(encoding, separator, decimal, headers, notes)


def _encoding(path: Path, head: bytes) -> tuple[str, tuple[str, ...]]:
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return encoding, () if encoding == "utf-8-sig" else ("text is UTF-16",)
    if b"\0" in head:
        raise BadInput(path, "text in UTF-8", "binary data or UTF-16 without a byte-order mark")
    try:
        head[: head.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252", ("text is not UTF-8: read as Windows-1252",)
    return "utf-8", ()


def _culprit(path: Path, dialect: _Dialect, wanted: list[str]) -> BadInput | None:
    """Search the file for the first row that cannot be used and say what is wrong with it."""
    columns = [(name, dialect.headers.index(name)) for name in wanted]
    empty = None
    with BoundedStream(path) as stream:
        text = io.TextIOWrapper(io.BufferedReader(stream), dialect.encoding, errors="replace", newline="")
        try:
            for row, cells in enumerate(csv.reader(text, delimiter=dialect.separator), start=1):
                if not any(cells):
                    empty = empty or row  # harmless at the end of the file
                elif row > 1 and empty:
                    return BadInput(f"{path}, row {empty}", f"{len(dialect.headers)} values", "an empty row")
                elif row > 1 and (error := _row_error(path, dialect, columns, row, cells)):
                    return error
        except csv.Error as error:
            return BadInput(path, "readable rows", str(error))
    return None


def _row_error(path: Path, dialect: _Dialect, columns, row: int, cells: list[str]) -> BadInput | None:
    where = f"{path}, row {row}"
    if any(cells[len(dialect.headers) :]):
        return _too_long(where, dialect.separator, len(dialect.headers), len(cells))
    for name, position in columns:
        cell = cells[position].strip() if position < len(cells) else ""
        if not _is_finite(cell, dialect.decimal):
            mixed = _is_finite(cell, ",") or _is_finite(cell, ".")
            hint = f" (the file's decimal mark is '{dialect.decimal}')" if mixed else ""
            found = f"'{cell[:40]}'{hint}" if cell else "nothing"
            return BadInput(f"{where}, column '{name}'", "a finite number", found)
    return None


def _too_long(where: str, separator: str, expected: int, found: int) -> BadInput:
    hint = " (decimal commas with a comma as separator?)" if separator == "," else ""
    return BadInput(where, f"{expected} values", f"{found}{hint}")


def _is_finite(cell: str, decimal: str) -> bool:
    if decimal == ",":
        cell = cell.translate({ord(","): ".", ord("."): ","})
    try:
        return math.isfinite(float(cell)) and "_" not in cell
    except ValueError:
        return False
