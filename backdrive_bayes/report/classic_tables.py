"""The classic least-squares fit of the published branch model, beside the posterior."""

from __future__ import annotations

from backdrive_bayes.figures.style import record_labels
from backdrive_bayes.number_text import UNDEFINED, fixed, like_interval, significant
from backdrive_bayes.report.blocks import Note, Paragraph, Table
from backdrive_bayes.report.fit_tables import INDICATORS

_TEXT = (
    "The classic evaluation fits eq. (20), reconstructed, to each branch by least squares. It gives no intervals; its branches "
    "do not close at ±T and constant friction hides in its offset, so that w(0), S and u may be far from the posterior's."
)
_HEADS = {
    "lost_motion_rad": "δ [arcmin]",
    "zero_torque_width_rad": "w(0) [arcmin]",
    "peak_angle_rad": "peak [arcmin]",
    "loop_area_J": "S [mJ]",
    "absorbed_J": "W_abs [mJ]",
    "dissipation_ratio": "u [–]",
}


def least_squares(saved) -> list:
    """The classic fit next to the posterior, one row a record; nothing where it was not saved."""
    rows = []
    for label, record in zip(record_labels(saved.records), saved.records, strict=True):
        classic = record.get("least_squares") or {}
        if classic.get("indicators"):
            rows.append([label, *(_cell(record, classic["indicators"], *about) for about in INDICATORS), _quality(classic)])
    if not rows:
        return []
    table = Table(["Record", *_HEADS.values(), "R²"], rows, [1.35, *[1.0] * 6, 1.05])
    note = "Least squares, with the posterior's median beneath. R²: the lower one of the two branches"
    ratios = [r for s in saved.records for r in _high_load(s)]
    high = f"; rms residual above 0.8 T_r over that below: up to {significant(max(ratios), 2)}" if ratios else ""
    return [Paragraph(_TEXT), table, Note(f"{note}{high}.")]


def _cell(record, classic, key, name, unit, factor):
    own, value = record["indicators"].get(key), classic.get(key)
    if key == "dissipation_ratio" and value is not None and not 0.0 <= value <= 1.0:
        value = None
    median = like_interval(own["median"], own, factor) if own else UNDEFINED
    return [like_interval(value, own, factor), median]


def _quality(classic):
    found = [b["r_squared"] for b in (classic.get("branches") or {}).values()]
    return fixed(min(found), 4) if found else "–"


def _high_load(record):
    branches = ((record.get("least_squares") or {}).get("branches") or {}).values()
    return [b["rms_high_load_over_rest"] for b in branches if b.get("rms_high_load_over_rest") is not None]
