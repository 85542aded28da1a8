"""The user's parameters with posterior, the prior that the class implies, and definitions."""

from __future__ import annotations

from backdrive_bayes.figures.style import shown_unit, words
from backdrive_bayes.report.blocks import Note, Table
from backdrive_bayes.report.numbers import interval_text, level_text
from backdrive_bayes.report.text import free


def parameters(saved) -> list:
    """A table of the parameters, and what each of them is."""
    rows, meanings = [], []
    for name, about in saved.indicators["parameters"].items():
        factor, unit = shown_unit(about["unit"], [about["median"]])
        shown = [interval_text(about[k] if k else about, factor) for k in (None, "prior_interval")]
        text = free(words(name))
        rows.append([text, shown[0], unit or "–", shown[1]])
        meanings.append(f"{text}: {free(about['definition'], 200)}")
    level = level_text(saved.indicators["level"])
    columns = ["Parameter", f"Posterior, {level}", "Unit", f"Implied prior, {level} (same unit)"]
    note = "Parameters are read off each drawn operator; the prior is what the class implies for them before any data."
    return [Table(columns, rows, [1.3, 1.35, 0, 1.85]), Note(f"{note} {'; '.join(meanings)}.")]
