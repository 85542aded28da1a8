"""The output folder of a fleet: one small result file a unit, written in one step, and a lock against a second fleet."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet.units import LOCK, FleetUnit

SCHEMA = "backdrive-bayes/fleet-unit/1"
DONE, FAILED, SET_ASIDE = "done", "failed", "set_aside"
UNITS, POSTERIORS = "units", "posteriors"


class CannotKeep(Exception):
    """A result that could not be written: the run cannot go on, for that of every other unit would be lost alike."""


def result_path(out: Path, unit: FleetUnit) -> Path:
    """The result file of a unit."""
    return Path(out) / UNITS / f"{unit.key}.json"


def posterior_folder(out: Path, unit: FleetUnit) -> Path:
    """The folder of a unit's posterior, where posteriors are kept."""
    return Path(out) / POSTERIORS / unit.key


def write_result(out: Path, unit: FleetUnit, stamp: dict, status: str, error: str | None, rows: list[dict]) -> None:
    """Keep what came of a unit; ``stamp`` is what it rests on."""
    data = hashes(rows[0]) if rows else []
    result = {"schema": SCHEMA, "unit": unit.name, "status": status, "error": error, "data_sha256": data, **stamp, "rows": rows}
    # Surrogates are names of files that are no Unicode: kept as escapes, which ASCII output writes.
    write_whole(result_path(out, unit), (json.dumps(result, indent=1, allow_nan=False) + "\n").encode("ascii"))


def hashes(row: dict) -> list[str]:
    """SHA-256 of a unit's records, of which every row of the unit holds all."""
    return [digest for digest in (row.get("data_sha256") or "").split(",") if digest]


def read_stored(out: Path, unit: FleetUnit) -> dict | None:
    """The object of a unit's result file; None where there is none that can be read."""
    try:
        found = json.loads(result_path(out, unit).read_bytes())
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and found.get("schema") == SCHEMA and found.get("unit") == unit.name else None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in one step; CannotKeep says what the system said."""
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        try:
            temporary.write_bytes(content)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise CannotKeep(f"{error.strerror or error}") from None


@contextlib.contextmanager
def locked(out: Path) -> Iterator[None]:
    """Make the output folder, hold it for one fleet, and take away what killed writers left; BadInput where it cannot be used.

    The system gives the lock up with the process that holds it, however that ends.
    """
    import fcntl

    out = Path(out)
    try:
        (out / UNITS).mkdir(parents=True, exist_ok=True)
        handle = os.open(out / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise BadInput(out, "a folder to write into", f"none ({error.strerror or error})") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise BadInput(out, "an output folder of its own for every fleet", "one that another fleet is writing to") from None
        for left in [*out.glob(".*.part"), *(out / UNITS).glob(".*.part")]:
            left.unlink(missing_ok=True)
        yield
    finally:
        # Closing is not enough: a worker that is being born holds a copy of the handle for a moment.
        fcntl.flock(handle, fcntl.LOCK_UN)
        os.close(handle)
