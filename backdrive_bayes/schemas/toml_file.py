"""Text files in TOML that a user writes: opened, bounded and typed in one place."""

from __future__ import annotations

import datetime
import tomllib
from pathlib import Path
from typing import Any, TypeVar

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.typed import typed

MAX_BYTES = 1_000_000
MAX_ENTRIES = 1000
"""Of one list or table: no unit has so many records, no drawing so many limits."""
MAX_DEPTH = 40
_LARGEST_INTEGER = 10**300
_DATES = (datetime.date, datetime.time)
T = TypeVar("T")


def read_typed(path: Path, shape: type[T], what: str, missing: str = "nothing there") -> T:
    """A TOML file as an object of ``shape``; BadInput names the key, what was expected and what was found."""
    return typed(read_toml(path, what, missing), shape, path)


def read_toml(path: Path, what: str, missing: str = "nothing there") -> dict[str, Any]:
    """The table of a TOML file, dates as text; ``what`` names the file expected, ``missing`` what is found where there is none.

    Raises BadInput where it is absent, larger than ``MAX_BYTES``, not UTF-8 or not TOML, and where it holds integers beyond
    a float's range, lists longer than ``MAX_ENTRIES`` or tables nested beyond ``MAX_DEPTH``.
    """
    try:
        if not path.is_file():
            raise BadInput(path, what, "a folder" if path.is_dir() else missing)
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise BadInput(path, f"{what} of at most 1 MB", "a larger one")
        table = tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))
    except BadInput:
        raise
    except UnicodeDecodeError as error:
        raise BadInput(path, "text in UTF-8", f"another encoding (byte {error.start})") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise BadInput(path, "valid TOML", str(error)[:200]) from error
    except ValueError as error:  # an integer of more digits than Python converts
        raise BadInput(path, "numbers of at most 300 digits", "a larger one") from error
    _refuse_absurd(path, table)
    return _dates_as_text(table)


def _refuse_absurd(path: Path, table: dict) -> None:
    """Walk through all values without recursion, as a hostile file may nest them deeper than the interpreter's stack."""
    waiting: list[tuple[str, object, int]] = [(str(key), value, 1) for key, value in table.items()]
    _refuse_many(path, "the file", table)
    while waiting:
        key, value, depth = waiting.pop()
        if depth > MAX_DEPTH:
            raise BadInput(f"{path}, key {key[:60]}", f"at most {MAX_DEPTH} tables within each other", "more")
        if isinstance(value, int) and abs(value) > _LARGEST_INTEGER:
            raise BadInput(f"{path}, key {key[:60]}", "a number of at most 300 digits", "a larger one")
        if isinstance(value, dict | list):
            _refuse_many(path, f"key {key[:60]}", value)
            children = value.items() if isinstance(value, dict) else ((key, child) for child in value)
            waiting += [(str(name), child, depth + 1) for name, child in children]


def _refuse_many(path: Path, where: str, values) -> None:
    if len(values) > MAX_ENTRIES:
        raise BadInput(f"{path}, {where}", f"at most {MAX_ENTRIES} entries", f"{len(values)}")


def _dates_as_text(value):
    if isinstance(value, dict):
        return {key: _dates_as_text(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_dates_as_text(inner) for inner in value]
    return str(value) if isinstance(value, _DATES) else value
