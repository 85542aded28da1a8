"""Reader of comma-separated text, plain or compressed."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.csv_culprit import culprit, too_long
from backdrive_bayes.records.readers.inflate import BoundedStream
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows
from backdrive_bayes.records.readers.table_head import MOST_HEAD_ROWS, TableHead, find_head

_HEAD_BYTES = 1 << 16
_CHUNK_ROWS = 500_000
_SEPARATORS = (";", "\t", ",")
_SEPARATOR_LINE = re.compile(r'"?sep=([;,\t])"?', re.IGNORECASE)
_LINE_END = re.compile("\r\n|\n|\r")
_MARKS = ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"))


@dataclass(frozen=True)
class Dialect:
    """How a file is written: text encoding, separator, decimal mark, names of the columns, lines above the first sample.

    ``marks_above`` counts the separators in those lines.
    """

    encoding: str
    separator: str
    decimal: str
    headers: tuple[str, ...]
    notes: tuple[str, ...]
    lines_above: int = 1
    marks_above: int = 0


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen columns; the header is row 1, or stands below a preamble and above a row of units.

    Separators are comma, semicolon or tab; decimal commas are read where the separator leaves no doubt. Text
    goes through the C parser in bounded chunks; only when that fails is the file searched line by line for
    the culprit.
    """
    dialect, lines = _sniff(path)
    wanted = list(choose(dialect.headers))
    dialect = replace(dialect, decimal=_decimal(dialect, lines, wanted))
    try:
        values, even = _parse(path, dialect, wanted)
    except BadInput:
        raise
    except (ValueError, OverflowError) as error:  # the parser's errors are ValueErrors and do not name the row
        fallback = BadInput(path, "columns of finite numbers", str(error))
        raise culprit(path, dialect, wanted) or fallback from error
    finite = all(np.isfinite(value).all() for value in values)
    fault = None if even and finite else culprit(path, dialect, wanted)
    if fault is not None or not finite:
        raise fault or BadInput(path, "columns of finite numbers", "a value that is not")
    return Columns(tuple(values), first_row=dialect.lines_above + 1, notes=dialect.notes)


def _parse(path: Path, dialect: Dialect, wanted: list[str]) -> tuple[list[np.ndarray], bool]:
    """Columns, and whether the separators in the file are as many as rows of equal length need.

    The parser drops surplus fields in silence; a decimal comma would shift the columns unseen.
    """
    import pandas  # imported here: it costs a quarter of a second that --help need not pay

    positions = [dialect.headers.index(name) for name in wanted]
    options: dict[str, Any] = dict(
        sep=dialect.separator,
        decimal=dialect.decimal,
        encoding=dialect.encoding,
        header=None,
        skiprows=dialect.lines_above,
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
    needed = (len(dialect.headers) - 1) * len(values[0])
    return values, stream.seen - dialect.marks_above == needed


def _without_trailing_blanks(values: list[np.ndarray]) -> list[np.ndarray]:
    if not all(np.isnan(value[-1]) for value in values):
        return values
    filled = np.flatnonzero(~np.all([np.isnan(value) for value in values], axis=0))
    return [value[: filled[-1] + 1 if filled.size else 0] for value in values]


def _decimal(dialect: Dialect, lines: list[str], wanted: list[str]) -> str:
    """Decimal mark of the columns that are read; dates and comments have marks of their own."""
    if dialect.separator == ",":
        return "."
    positions = {dialect.headers.index(name) for name in wanted}
    rows = csv.reader(lines, delimiter=dialect.separator)
    read = "".join(cell for row in rows for position, cell in enumerate(row) if position in positions)
    return "," if read.count(",") > read.count(".") else "."


def _sniff(path: Path) -> tuple[Dialect, list[str]]:
    """How a file is written, decimal points assumed, and the first lines of its samples."""
    with BoundedStream(path) as stream:
        head = io.BufferedReader(stream, _HEAD_BYTES).read(_HEAD_BYTES)
    encoding, notes = _encoding(path, head)
    lines = _LINE_END.split(head.decode(encoding, errors="replace"))
    if len(head) == _HEAD_BYTES:
        lines.pop()
        if len([line for line in lines if line]) < 2:
            raise BadInput(path, "lines of text", f"a line longer than {_HEAD_BYTES} bytes")
    if (filled := len([line for line in lines if line])) < 2:
        raise BadInput(path, "a header and samples", f"{filled} line{'s'[: filled != 1]}")
    separator, found = _table(path, lines)
    first = next(csv.reader([lines[found.first_row]], delimiter=separator), [])
    if any(first[len(found.names) :]):
        raise too_long(f"{path}, row {found.first_row + 1}", separator, len(found.names), len(first))
    marks = sum(line.count(separator) for line in lines[: found.first_row])
    dialect = Dialect(encoding, separator, ".", found.names, notes + found.notes, found.first_row, marks)
    return dialect, lines[found.first_row :]


def _table(path: Path, lines: list[str]) -> tuple[str, TableHead]:
    """Separator and head of a table in text; the separator is the one that gives most columns, unless the file names it."""
    named = _SEPARATOR_LINE.fullmatch(lines[0].strip())
    start = 1 if named else 0
    heads = {mark: find_head(_cells(lines[:start], lines[start:], mark)) for mark in ([named[1]] if named else _SEPARATORS)}
    separator, found = max(heads.items(), key=lambda item: len(item[1].names) if item[1] else 0)
    if found is not None:
        return separator, found
    row = next(i for i, line in enumerate(lines) if i >= start and line)
    separator = named[1] if named else max(",;\t", key=lines[row].count)
    if separator not in lines[row]:
        expected = "columns separated by comma, semicolon or tab"
        raise BadInput(f"{path}, row {row + 1}", expected, f"'{lines[row][:60]}'")
    names = next(csv.reader([lines[row]], delimiter=separator))
    return separator, TableHead(tuple(name.strip() for name in names), min(row + 1, len(lines) - 1))


def _cells(above: list[str], lines: list[str], separator: str) -> list[list[str]]:
    lines = lines[:MOST_HEAD_ROWS]
    return [[] for _ in above] + [next(csv.reader([line], delimiter=separator), []) for line in lines]


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
