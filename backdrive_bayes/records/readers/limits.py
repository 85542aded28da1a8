"""What every reader shares: its result, and bounds that keep a hostile file from filling the memory."""

from __future__ import annotations

import logging
import stat
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput

MAX_BYTES = 2_000_000_000
"""Of a file, and of what it inflates to."""
MAX_ROWS = 20_000_000
MAX_INFLATION, FREE_INFLATED_BYTES = 150, 50_000_000
"""Beyond so many bytes: real records of text shrink three- to tenfold, a bomb of zeros shrinks a thousandfold."""
MOST_DEPTH, MOST_ARRAYS = 4, 5000
"""Of a MATLAB file: structures within structures, and arrays in all."""

Choose = Callable[[tuple[str, ...]], Sequence[str]]


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of a file, float64 arrays (samples,); ``first_row`` is the row of sample 0, counted from 1."""

    values: tuple[np.ndarray, ...]
    first_row: int = 1
    notes: tuple[str, ...] = ()


def check_file_size(path: Path) -> None:
    """Refuse what is not a regular file of at most 2 GB, before a byte of it is read."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise BadInput(path, "a readable file", _reason(error)) from error
    if not stat.S_ISREG(status.st_mode):
        raise BadInput(path, "a regular file", "a folder" if path.is_dir() else "something else")
    if status.st_size > MAX_BYTES:
        raise BadInput(path, "a file of at most 2 GB", f"{status.st_size / 1e9:.1f} GB")
    if status.st_size == 0:
        raise BadInput(path, "a table of samples", "an empty file")


def silence(package: str) -> None:
    """Keep a parser's loggers, of which some write to the terminal by themselves, from talking about damaged files."""
    for name in [package, *logging.root.manager.loggerDict]:
        if name == package or name.startswith(f"{package}."):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def check_rows(path: Path, rows: int) -> None:
    """Refuse tables longer than any bench record."""
    if rows > MAX_ROWS:
        raise BadInput(path, f"at most {MAX_ROWS} rows", f"{rows} rows")


def finite_columns(path: Path, headers: Sequence[str], arrays: Sequence, word: str = "sample") -> Columns:
    """Convert a binary format's columns to float64; BadInput names the first sample that is not finite."""
    values = tuple(_as_float(path, header, array) for header, array in zip(headers, arrays, strict=True))
    lengths = [len(value) for value in values]
    if len(set(lengths)) > 1:
        pairs = ", ".join(f"{header}: {length}" for header, length in zip(headers, lengths, strict=True))
        raise BadInput(path, "columns of equal length", pairs)
    check_rows(path, lengths[0])
    for header, value in zip(headers, values, strict=True):
        bad = np.flatnonzero(~np.isfinite(value))
        if bad.size:
            raise BadInput(f"{path}, {word} {bad[0] + 1}, column '{header}'", "a finite number", f"{value[bad[0]]}")
    return Columns(values)


def _as_float(path: Path, header: str, array) -> np.ndarray:
    array = np.asarray(array)
    if array.dtype.kind not in "fiu":
        raise BadInput(f"{path}, column '{header}'", "numbers", f"{array.dtype} values")
    return np.ascontiguousarray(array.ravel(), dtype=np.float64)


def _reason(error: Exception) -> str:
    return "nothing there" if isinstance(error, FileNotFoundError) else getattr(error, "strerror", None) or str(error)
