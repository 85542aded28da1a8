"""The classic least-squares fit of the published branch model, beside the posterior."""

from __future__ import annotations

from backdrive_bayes.figures.style import ARCMIN_PER_RAD, record_labels
from backdrive_bayes.report.blocks import Note, Paragraph, Table
from backdrive_bayes.report.fit_tables import INDICATORS
from backdrive_bayes.report.numbers import fixed, interval_text, level_text, like_interval, significant


def least_squares(saved) -> list:
    """The classic fit next to the posterior; nothing where it was not saved."""
    blocks = []
    for label, record in zip(record_labels(saved.records), saved.records, strict=True):
        classic = record.get("least_squares") or {}
        if classic.get("indicators"):
            blocks.append(_classic_table(label, record, classic["indicators"], saved.indicators["level"]))
        if classic.get("branches"):
            blocks.append(Note(f"{label}: " + "; ".join(_branch(n, b) for n, b in classic["branches"].items()) + "."))
    if not blocks:
        return []
    text = (
        "The classic evaluation fits eq. (20), reconstructed, to each branch by least squares. It gives no "
        "intervals; its branches do not close at ±T and constant friction hides in its offset, so its S is "
        "usually too small."
    )
    return [Paragraph(text), *blocks]


def _classic_table(label, record, classic, level):
    rows = []
    for key, name, unit, factor in INDICATORS:
        own = record["indicators"].get(key)
        rows.append([name, unit, interval_text(own, factor), like_interval(classic.get(key), own, factor)])
    return Table(
        [label, "Unit", f"Posterior, {level_text(level)}", "Least squares"], rows, [1.6, 0, 1.3, 1.0]
    )


def _branch(name, branch):
    ratio = branch.get("rms_high_load_over_rest")
    high = f", rms above 0.8 T_r over the rest {significant(ratio, 2)}" if ratio is not None else ""
    rms = significant(branch["rms_rad"], 2, ARCMIN_PER_RAD)
    return f"{name} branch: R² = {fixed(branch['r_squared'], 4)}, rms residual {rms} arcmin{high}"
