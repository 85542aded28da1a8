"""The sampled parameters with posterior and prior; those of single records side by side."""

from __future__ import annotations

from backdrive_bayes.figures.style import PER_FIGURE, parts, record_labels, shown_unit, words
from backdrive_bayes.report.blocks import Table
from backdrive_bayes.report.numbers import interval_text, level_text, prior_text
from backdrive_bayes.report.text import free


def parameters(saved) -> list:
    """A table of the parameters that all records share, then tables of those that each has for itself."""
    shared, own = [], {}
    for name, about in saved.indicators["parameters"].items():
        factor, unit = shown_unit(about["unit"], [about["median"]])
        base, bracket, record = name.partition("[")
        shown = interval_text(about, factor)
        if bracket and record[:-1].isdecimal() and int(record[:-1]) < len(saved.records):
            title = free(f"{words(base)} [{unit}]" if unit else words(base))
            own.setdefault((title, prior_text(about["prior"], factor)), {})[int(record[:-1])] = shown
        else:
            shared.append([free(words(name)), shown, unit or "–", prior_text(about["prior"], factor)])
    columns = ["Parameter", f"Posterior, {level_text(saved.indicators['level'])}", "Unit", "Prior (same unit)"]
    return [Table(columns, shared, [1.3, 1.35, 0, 1.85]), *_of_records(saved, own)]


def _of_records(saved, own):
    """Tables of the parameters of single records, from texts by title, prior and record."""
    blocks, level = [], level_text(saved.indicators["level"])
    for part in parts(list(enumerate(record_labels(saved.records))), PER_FIGURE):
        rows = [
            [[title, prior], *(texts.get(i, "–") for i, _ in part)]
            for (title, prior), texts in own.items()
            if any(i in texts for i, _ in part)
        ]
        if rows:
            blocks.append(Table([f"Of single records, {level}", *(label for _, label in part)], rows, [1.3, *[1.1] * len(part)]))
    return blocks
