"""Reader of Excel workbooks: the first sheet with a row of names above rows of numbers."""

from __future__ import annotations

import zipfile
from array import array
from itertools import islice
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.readers import limits
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows
from backdrive_bayes.records.readers.table_head import MOST_HEAD_ROWS, find_head

_MOST_COLUMNS = 1000


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen columns; rows are counted as Excel counts them, text that is a number with a comma is read as one."""
    try:
        import openpyxl
    except ImportError as error:
        raise MissingExtra("reading Excel workbooks", "openpyxl", "readers") from error
    _refuse_bomb(path)
    book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
    try:
        for sheet in book.worksheets:
            sheet.reset_dimensions()  # what a writer claims of a sheet's size is not to be trusted
            head = find_head(_text_rows(sheet), _is_number)
            if head is not None:
                only = len(book.worksheets) == 1
                notes = head.notes if only else (*head.notes, f"read sheet '{sheet.title}'")
                return _read_sheet(path, sheet, head, choose, notes)
    finally:
        book.close()
    raise BadInput(path, "a sheet with names above columns of numbers", "none")


def _refuse_bomb(path: Path) -> None:
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError, EOFError) as error:
        raise BadInput(path, "an Excel workbook (.xlsx)", str(error)[:80] or type(error).__name__) from error
    bomb = size > limits.FREE_INFLATED_BYTES and size > limits.MAX_INFLATION * path.stat().st_size
    if bomb or size > limits.MAX_BYTES:
        raise BadInput(path, "at most 2 GB once inflated, and no bomb", f"{size / 1e6:.0f} MB")


def _text_rows(sheet) -> list[list[str]]:
    rows = islice(sheet.iter_rows(values_only=True, max_col=_MOST_COLUMNS), MOST_HEAD_ROWS)
    return [["" if cell is None else str(cell) for cell in row] for row in rows]


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True


def _read_sheet(path: Path, sheet, head, choose: Choose, notes) -> Columns:
    wanted = list(choose(tuple(name for name in head.names if name)))
    positions = [head.names.index(name) for name in wanted]
    values, blank = [array("d") for _ in wanted], 0
    for number, row in enumerate(sheet.iter_rows(min_row=head.first_row + 1, values_only=True), start=head.first_row + 1):
        cells = [row[at] if at < len(row) else None for at in positions]
        if all(cell is None or cell == "" for cell in cells):
            blank = blank or number
            continue
        if blank:
            raise BadInput(f"{path}, row {blank}", "values", "an empty row")
        for name, cell, column in zip(wanted, cells, values, strict=True):
            column.append(_value(path, number, name, cell))
        check_rows(path, len(values[0]))
    return Columns(tuple(np.frombuffer(v, float) if v else np.zeros(0) for v in values), head.first_row + 1, notes)


def _value(path: Path, row: int, name: str, cell) -> float:
    try:
        value = float(cell.replace(",", ".") if isinstance(cell, str) else cell)
    except (TypeError, ValueError, OverflowError):
        value = np.nan
    if not np.isfinite(value) or isinstance(cell, bool):
        found = "nothing" if cell is None else f"'{str(cell)[:40]}'"
        raise BadInput(f"{path}, row {row}, column '{name}'", "a finite number", found)
    return value
