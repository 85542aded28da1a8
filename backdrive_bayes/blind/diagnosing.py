"""The diagnosis that a blind check puts to the test: a folder goes in, the object of diagnosis.json comes out."""

from __future__ import annotations

from pathlib import Path


def diagnose_folder(folder: Path, allowed: tuple[str, ...] | None) -> dict:
    """Diagnose a unit's folder with the library ``allowed`` (None: all of it), as the verb ``diagnose`` would."""
    from backdrive_bayes.gap.diagnose import diagnose
    from backdrive_bayes.records.unit_folder import read_unit

    return diagnose(read_unit(folder), allowed=allowed).json
