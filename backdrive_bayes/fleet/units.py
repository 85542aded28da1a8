"""Which units a fleet has, and what tells whether one of them changed."""

from __future__ import annotations

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers import record_suffix

UNIT_FILE = "unit.toml"
LOCK = ".fleet.lock"
"""Lies in a folder to which a fleet's table is written."""
PREDICTION, PREDICTED = "prediction.json", ("prediction.csv", "draws.csv")
"""What a prediction writes, and which of it looks like records."""


@dataclass(frozen=True)
class FleetUnit:
    """A unit by its absolute ``path`` and its ``name``, the path below the fleet's folder, which no two units share."""

    name: str
    path: Path

    @property
    def key(self) -> str:
        """A file name of its own: what can be read of the name, and a digest of all of it."""
        readable = re.sub(r"[^\w.+-]+", "-", self.name).strip(".-")[-60:] or "unit"
        return f"{readable}.{hashlib.sha256(os.fsencode(self.name)).hexdigest()[:10]}"

    def digest(self) -> str | None:
        """SHA-256 of names and bytes of the unit's files; None where one cannot be read.

        It is of everything in the folder, so that a broken unit has one too; what results carry is the hash of the data.
        """
        digest = hashlib.sha256()
        try:
            files = sorted(p for p in self.path.rglob("*") if p.is_file()) if self.path.is_dir() else [self.path]
            for file in files:
                content = hashlib.sha256(file.read_bytes()).digest()
                digest.update(os.fsencode(file.relative_to(self.path.parent)) + b"\0" + content)
        except OSError:
            return None
        return digest.hexdigest()


def find_units(folder: Path, out: Path) -> list[FleetUnit]:
    """Every unit folder below ``folder`` (or itself) and every record file outside of unit folders, in order of their names.

    Links to unit folders count, links to other folders are not followed. ``out``, hidden folders and the tables of fleets are
    left out. Raises BadInput where there is none, or ``out`` lies inside a unit.
    """
    folder, out = Path(folder).resolve(), Path(out).resolve()
    if not folder.is_dir():
        raise BadInput(folder, "a folder of units", "a file" if folder.exists() else "no such folder")
    found = []
    for place, below, files in os.walk(folder):
        here = Path(place)
        if UNIT_FILE in files:
            if out.is_relative_to(here):
                raise BadInput(out, "a folder for results outside of units", f"one inside the unit '{here}'")
            found.append(here)
            below.clear()
            continue
        found += [here / name for name in below if (here / name).is_symlink() and (here / name / UNIT_FILE).is_file()]
        below[:] = sorted(name for name in below if not name.startswith(".") and here / name != out)
        # What the package itself wrote is no record.
        own = PREDICTED if PREDICTION in files else ()
        records = (name for name in sorted(files) if not name.startswith(".") and name not in own and record_suffix(here / name))
        found += [here / name for name in records] if LOCK not in files else []
    if not found:
        raise BadInput(folder, "a folder with units (unit.toml and record files) below it", "none")
    return sorted((FleetUnit(_name(path, folder), path) for path in found), key=lambda unit: unit.name)


def _name(path: Path, folder: Path) -> str:
    """Below the fleet's folder, with what is no Unicode spelt out."""
    name = folder.name if path == folder else path.relative_to(folder).as_posix()
    return os.fsencode(name).decode("utf-8", "backslashreplace")
