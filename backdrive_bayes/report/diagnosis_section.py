"""The chapter of a diagnosis: verdict and overview on one page, then what stands behind it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from backdrive_bayes.figures import diagnosis
from backdrive_bayes.figures.catalogue import caption
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.style import words
from backdrive_bayes.report import diagnosis_simulated as simulated
from backdrive_bayes.report import diagnosis_tables as tables
from backdrive_bayes.report.blocks import Banner, Block, Chapter, Facts, Heading, Picture, Signature
from backdrive_bayes.report.diagnosis_text import TERMS, next_test, outcome, verdict
from backdrive_bayes.report.findings import findings_blocks, warned
from backdrive_bayes.report.text import Free, free
from backdrive_bayes.results import usable

LISTED = 4
"""Records that the summary names."""
SHOWN = ("diagnosis", "gap-residual", "simulator")
"""Figures that the report shows, beside the map of many records."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``diagnose`` and lay out its pages."""
    saved = Diagnosed.read(folder)
    figures = diagnosis.figures_of(saved, partial(_shown, saved))
    title = Free(free(saved.result["unit"], 66) + ": diagnosis")
    overview = [("diagnosis", caption("diagnosis"))] if "diagnosis" in figures else []
    return Chapter(
        title,
        [
            Heading(title, 1),
            Banner(*verdict(saved)),
            *findings_blocks(saved.result),
            _identity(saved),
            *(Picture(*about) for about in overview),
            Signature(["Reviewed by", "Date", "Signature"]),
        ],
        [*(Picture(*about, spilt=True) for about in overview), *_details(saved, figures)],
        figures,
        pages=simulated.pages(saved, [Picture(n, caption(n, saved.level)) for n in figures if n == "simulator"]),
        outcome=", ".join(filter(None, [outcome(saved), warned(saved.result)])),
        terms=[Heading("Diagnosis"), Facts(TERMS)] if saved.result["which"] else [],
        provisional=not usable(saved.result),
    )


def _shown(saved, name):
    """Whether the report shows a figure; the others stand in the result folder only."""
    if name.startswith("gap-map"):  # it stands on the summary already, unless that had no room for all records
        return len(saved.records) > len(diagnosis.mapped(saved))
    return name in SHOWN


def _identity(saved):
    rows = [
        ("Baseline", free(" + ".join(words(m) for m in saved.result.get("baseline") or []) or "not recorded")),
        *([("Simulator", free(saved.simulator.get("unit") or "not named", 80))] if saved.simulator else []),
        ("Records", _record_list(saved)),
        ("Gap", tables.gap_text(saved)),
    ]
    if saved.added:
        rows.append(("Held out", free(tables.held_out_text(saved))))
    return Facts(rows)


def _record_list(saved):
    records = saved.labels
    more = f"; and {len(records) - LISTED} more" if len(records) > LISTED else ""
    return free(f"{len(records)}: {'; '.join(records[:LISTED])}{more}", 600)


def _details(saved, figures) -> list[Block]:
    def pictures(kind):
        return [Picture(n, caption(n, saved.level)) for n in figures if n == kind or n.startswith(f"{kind}-")]

    parts = (
        ("Which effect", [*tables.probabilities(saved), *tables.effect_parameters(saved)] if saved.effects else []),
        ("Next test", next_test(saved)),
        ("How far it shrinks", tables.shrink(saved) if saved.added else []),
        ("What it changes", [*tables.indicators(saved), *tables.parameter_shift(saved)] if saved.added else []),
        ("", tables.convergence(saved) if saved.effects else []),
        ("Where the gap lies", [*pictures("gap-map"), *pictures("gap-residual")] if saved.effects else []),
    )
    return [b for name, blocks in parts if blocks for b in (*([Heading(name)] if name else []), *blocks)]
