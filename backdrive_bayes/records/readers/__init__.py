"""Readers of record files, one file a format; ``read_columns`` picks the one for a path."""

from __future__ import annotations

import importlib
import warnings
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.readers.limits import Choose, Columns, check_file_size

READERS = {
    ".csv": "csv_file",
    ".csv.gz": "csv_file",
    ".csv.xz": "csv_file",
    ".xlsx": "xlsx_file",
    ".parquet": "parquet_file",
    ".tdms": "tdms_file",
    ".mat": "mat_file",
    ".mf4": "mdf_file",
}


def record_suffix(path: Path) -> str | None:
    """The ending of ``path`` that names a readable format, or None."""
    name = path.name.lower()
    return next((suffix for suffix in READERS if name.endswith(suffix)), None)


def read_columns(path: Path, choose: Choose) -> Columns:
    """Read the columns of a record file that ``choose`` names, as float64 arrays of equal length.

    ``choose`` is called once with the file's headers and returns those wanted, in order. Raises BadInput for
    anything unreadable, not numeric, not finite or too large, and MissingExtra where a format needs a package
    that is absent.
    """
    suffix = record_suffix(path)
    if suffix is None:
        raise BadInput(path, f"a file ending in {', '.join(READERS)}", f"'{path.name}'")
    check_file_size(path)
    reader = importlib.import_module(f"{__name__}.{READERS[suffix]}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a parser's doubts about styles or dates are no concern of the user's
            return reader.read(path, choose)
    except (BadInput, MissingExtra, MemoryError):
        raise
    # Parsers of foreign formats raise whatever they stumble over in damaged bytes.
    except Exception as error:
        raise BadInput(path, f"a readable {suffix} file", f"{type(error).__name__} {str(error)[:120]}".strip()) from error
