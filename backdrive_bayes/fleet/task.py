"""What a worker does with one unit: skip it where its result is there already, else work on it and keep what comes."""

from __future__ import annotations

import contextlib
import io
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

from threadpoolctl import threadpool_limits

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet.store import DONE, FAILED, CannotKeep, posterior_folder, read_stored, write_result
from backdrive_bayes.fleet.units import FleetUnit

KEPT = "kept"


@dataclass(frozen=True)
class Job:
    """What is done with every unit: ``work(path, folder)`` gives the rows of a unit, a dict of plain values a record.

    It writes what it keeps beside them into ``folder`` (None: nothing is kept). ``options`` with the ``seed`` decide about the
    rows and nothing else does.
    """

    out: Path
    work: Callable[[Path, Path | None], list[dict]]
    seed: int = 0
    options: dict = field(default_factory=dict)
    posteriors: bool = False
    version: str = field(default_factory=lambda: version("backdrive-bayes"))

    def stamp(self, unit: FleetUnit) -> dict:
        """What the result of a unit rests on."""
        return {"files_sha256": unit.digest(), "version": self.version, "seed": self.seed, "options": self.options}

    def has(self, unit: FleetUnit, stamp: dict) -> bool:
        """Whether the result of a unit is there and rests on the same."""
        found = read_stored(self.out, unit)
        if found is None or stamp["files_sha256"] is None or any(found.get(key) != value for key, value in stamp.items()):
            return False
        return found["status"] == FAILED or not self.posteriors or posterior_folder(self.out, unit).is_dir()


@dataclass(frozen=True)
class Done:
    """What became of a unit: ``kept``, ``done`` or ``failed``, and the seconds that its work took."""

    status: str
    error: str | None
    seconds: float


def carry_out(job: Job, unit: FleetUnit) -> Done:
    """Work on one unit and write its result file; an error of the unit becomes its result.

    Raises CannotKeep where the result cannot be written, BadInput where the worker is of another version.
    """
    began = time.perf_counter()
    if version("backdrive-bayes") != job.version:
        raise BadInput("--scheduler", f"workers of version {job.version}", version("backdrive-bayes"))
    stamp = job.stamp(unit)
    if job.has(unit, stamp):
        return Done(KEPT, None, time.perf_counter() - began)
    # One that is there rests on something else.
    shutil.rmtree(posterior_folder(job.out, unit), ignore_errors=True)
    folder = posterior_folder(job.out, unit) if job.posteriors else None
    try:
        # What verbs say of a unit stands in its rows; sums in another order would change last bits.
        with contextlib.redirect_stdout(io.StringIO()), threadpool_limits(1, user_api="blas"):
            rows, error = job.work(unit.path, folder), None
    except CannotKeep:
        raise
    except BadInput as raised:
        rows, error = [], _line(raised)
    except Exception as raised:
        # No fault of the unit's files, such as a reader that is not installed: it is tried once more.
        rows, error, stamp = [], _line(raised), stamp | {"files_sha256": None}
    status = FAILED if error else DONE
    # Where a fleet lies is no part of its results.
    error = error and error.replace(str(unit.path), unit.name)
    write_result(job.out, unit, stamp, status, error, rows)
    return Done(status, error, time.perf_counter() - began)


def _line(error: Exception) -> str:
    named = str(error) if isinstance(error, BadInput) else f"{type(error).__name__}: {error}"
    return " ".join(named.split())[:2000]
