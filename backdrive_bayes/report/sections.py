"""The kinds of results a report knows: one line each."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.report import (
    acceptance_section,
    blind_section,
    check_section,
    comparison_section,
    diagnosis_section,
    fit_section,
    fleet_section,
    pool_section,
    prediction_section,
)
from backdrive_bayes.report.blocks import Chapter
from backdrive_bayes.results import (
    CHECK,
    DIAGNOSIS,
    INDICATORS,
    PREDICTION,
    VERDICT,
    read_groups,
    read_result,
    require_own_posterior,
    require_same_data,
    require_same_records,
)

SECTIONS = {
    "verdict.json": acceptance_section.chapter,
    "comparison.json": comparison_section.chapter,
    "indicators.json": fit_section.chapter,
    "diagnosis.json": diagnosis_section.chapter,
    "prediction.json": prediction_section.chapter,
    "check.json": check_section.chapter,
    "blind.json": blind_section.chapter,
    "fleet.json": fleet_section.chapter,
    "pool.json": pool_section.chapter,
}
"""Result file name → function that reads its folder and returns a chapter; chapters come in this order."""


def chapters(folder: Path) -> list[Chapter]:
    """The chapters of all results in a folder; BadInput where there is none, or where they are not of the same data."""
    folder = Path(folder)
    if not folder.is_dir():
        raise BadInput(folder, "a result folder", "no such folder")
    _require_one_unit(folder)
    there = [name for name in SECTIONS if (folder / name).exists()]
    # What a check found stands in the chapter of the fit that rests on it.
    if "indicators.json" in there:
        there = [name for name in there if name != "check.json"]
    found = [_chapter(SECTIONS[name], folder / name) for name in there]
    if not found:
        raise BadInput(folder, f"a result folder with {' or '.join(SECTIONS)}", "none of them")
    return found


def _require_one_unit(folder: Path) -> None:
    """BadInput where what a folder holds of one unit does not belong together."""
    schemas = {"indicators.json": INDICATORS, "diagnosis.json": DIAGNOSIS, "verdict.json": VERDICT}
    found = {name: read_result(folder / name, schema) for name, schema in schemas.items() if (folder / name).exists()}
    path = folder / "posterior.nc"
    if "indicators.json" in found and path.exists():
        require_own_posterior(path, read_groups(path)["posterior"].attrs, found["indicators.json"])
    for name, result in found.items():
        about = next(iter(found.values()))
        # A verdict rests on the fit, whichever version made that.
        require_same_data(folder / name, result, about, version=name == "diagnosis.json" and "indicators.json" in found)
    for name, schema in {"prediction.json": PREDICTION, "check.json": CHECK}.items():
        if found and (folder / name).exists():
            require_same_records(folder / name, read_result(folder / name, schema), next(iter(found.values())))


def _chapter(make, path: Path) -> Chapter:
    try:
        return make(path.parent)
    except BadInput:
        raise
    except (KeyError, IndexError, TypeError, AttributeError, ValueError) as error:
        text = f"{type(error).__name__} {error}"
        raise BadInput(path, "a complete result file and its posterior.nc", text) from error
