"""The diagnosis that a blind check puts to the test: a folder goes in, the object of diagnosis.json comes out."""

from __future__ import annotations

from pathlib import Path


def diagnose_folder(folder: Path, allowed: tuple[str, ...] | None) -> dict:
    """Diagnose a unit's folder with the library ``allowed`` (None: all of it), as the verb ``diagnose`` would: also what the
    measured cycles say against the chosen model counts."""
    from backdrive_bayes.gap.diagnose import diagnose
    from backdrive_bayes.indicators.convergence import judged_convergence
    from backdrive_bayes.records.unit_folder import read_unit

    unit = read_unit(folder)
    found = diagnose(unit, allowed=allowed)
    return found.json | {"convergence": judged_convergence(found.posterior, found.json["k"], unit)}
