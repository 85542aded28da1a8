"""The first page of a report on several results: what is inside and how each came out."""

from __future__ import annotations

from importlib.metadata import version

from backdrive_bayes.figures.style import shortened
from backdrive_bayes.report.blocks import Block, Chapter, Contents, Facts, Heading, Note, Table
from backdrive_bayes.report.findings import FORCED, PROVISIONAL
from backdrive_bayes.report.text import Free, free

MOST_UNITS = 3
"""Units beside each other in the table of key indicators."""
MOST_FACTS = 6


def overview_blocks(chapters: list[Chapter], title: str) -> list[Block]:
    """Units, outcomes, key indicators and contents of the report's chapters."""
    fits = [c.about for c in chapters if c.about]
    units = {(about.unit, about.data): about for about in fits}
    facts = [("Software", f"backdrive-bayes {version('backdrive-bayes')}"), *list(_units(units.values()))[:MOST_FACTS]]
    rows = [[free(c.title, 60), c.outcome or "–"] for c in chapters]
    return [
        Heading(free(title, 90), 1),
        Facts(facts),
        Heading("Results"),
        Table(["Result", "Outcome"], rows, [1.0, 2.6]),
        *_key_indicators(fits),
        Heading("Contents"),
        Contents(),
    ]


def _units(units):
    for about in units:
        yield free(shortened(about.unit)), free("; ".join(f"{value}" for _, value in about.facts) or "no description", 220)


def _key_indicators(fits) -> list[Block]:
    """One column a fit, of the first ones; nothing where no unit was fitted."""
    if not fits:
        return []
    units, more = fits[:MOST_UNITS], len(fits) - MOST_UNITS
    values = [{name: text for name, _, text in u.indicators} for u in units]
    rows = [[name, unit, *(v.get(name, "–") for v in values)] for name, unit, _ in units[0].indicators]
    loops = "; ".join(f"{free(shortened(u.unit))}: {u.loop}" for u in units)
    columns = ["Indicator", "Unit", *(Free(f"{free(shortened(u.unit))}{', FORCED' * u.forced}") for u in units)]
    marks = f" {PROVISIONAL}" * any(u.provisional for u in units) + f" {FORCED}" * any(u.forced for u in units)
    further = f" Of {more} further {'fits' if more > 1 else 'fit'} see the chapters." if more > 0 else ""
    return [
        Heading("Key indicators"),
        Table(columns, rows, [1.6, 0, *[1.4] * len(units)]),
        Note(f"Median and credible interval of the settled loop. {loops}.{marks}{further}"),
    ]
