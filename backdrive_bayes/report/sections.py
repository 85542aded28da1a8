"""The kinds of results a report knows: one line each."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.report import acceptance_section, blind_section, comparison_section, diagnosis_section, fit_section
from backdrive_bayes.report.blocks import Chapter

SECTIONS = {
    "verdict.json": acceptance_section.chapter,
    "comparison.json": comparison_section.chapter,
    "indicators.json": fit_section.chapter,
    "diagnosis.json": diagnosis_section.chapter,
    "blind.json": blind_section.chapter,
}
"""Result file name → function that reads its folder and returns a chapter; chapters come in this order."""


def chapters(folder: Path) -> list[Chapter]:
    """The chapters of all results in a folder; BadInput where there is none."""
    folder = Path(folder)
    if not folder.is_dir():
        raise BadInput(folder, "a result folder", "no such folder")
    found = [_chapter(make, folder / name) for name, make in SECTIONS.items() if (folder / name).exists()]
    if not found:
        raise BadInput(folder, f"a result folder with {' or '.join(SECTIONS)}", "none of them")
    return found


def _chapter(make, path: Path) -> Chapter:
    try:
        return make(path.parent)
    except BadInput:
        raise
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        text = f"{type(error).__name__} {error}"
        raise BadInput(path, "a complete result file and its posterior.nc", text) from error
