"""The user's parameters with posterior, the prior that the class implies, and definitions."""

from __future__ import annotations

from backdrive_bayes.figures.style import shown_unit, words
from backdrive_bayes.number_text import ENDS, interval_text, level_text
from backdrive_bayes.report.blocks import Table
from backdrive_bayes.report.text import free


def parameters(saved) -> list:
    """A table of the parameters."""
    rows = []
    for name, about in saved.indicators["parameters"].items():
        factor, unit = shown_unit(about["unit"], [about[k] for k in ENDS])
        shown = [interval_text(about[k] if k else about, factor) for k in (None, "prior_interval")]
        rows.append([free(words(name)), shown[0], unit or "–", shown[1]])
    level = level_text(saved.indicators["level"])
    columns = ["Parameter", f"Posterior, {level}", "Unit", f"Implied prior, {level} (same unit)"]
    return [Table(columns, rows, [1.3, 1.35, 0, 1.85])]


def meanings(saved) -> str:
    """What each of the parameters is, in one paragraph."""
    told = [f"{free(words(n))}: {free(about['definition'], 200)}" for n, about in saved.indicators["parameters"].items()]
    note = (
        "Parameters are read off each drawn operator; the prior is what the class implies for them before any data. The class "
        "does not forbid signs that no reducer has; where an interval reaches below zero, the data do not tell the size."
    )
    return f"{note} {'; '.join(told)}."
