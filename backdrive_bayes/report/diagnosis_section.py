"""The chapter of a diagnosis: verdict and overview on one page, then what stands behind it."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures import diagnosis
from backdrive_bayes.figures.catalogue import caption
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import label_words
from backdrive_bayes.figures.style import words
from backdrive_bayes.report import diagnosis_tables as tables
from backdrive_bayes.report.blocks import Banner, Block, Chapter, Facts, Heading, Paragraph, Picture, Signature
from backdrive_bayes.report.diagnosis_text import TERMS, next_test, verdict
from backdrive_bayes.report.numbers import level_text
from backdrive_bayes.report.text import Free, free

LISTED = 4
"""Records that the summary names."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``diagnose`` and lay out its pages."""
    saved = Diagnosed.read(folder)
    figures = diagnosis.figures_of(saved)
    title = Free(free(saved.result["unit"], 66) + ": diagnosis")
    overview = [("diagnosis", caption("diagnosis"))] if "diagnosis" in figures else []
    return Chapter(
        title,
        [
            Heading(title, 1),
            Banner(*verdict(saved)),
            _identity(saved),
            *(Picture(*about) for about in overview),
            Signature(["Reviewed by", "Date", "Signature"]),
        ],
        [*(Picture(*about, spilt=True) for about in overview), *_details(saved, figures)],
        figures,
    )


def _identity(saved):
    rows = [
        ("Unit", free(saved.result["unit"])),
        ("Baseline", free(" + ".join(words(m) for m in saved.result.get("baseline") or []) or "not recorded")),
        ("Records", _record_list(saved)),
        ("Gap", tables.gap_text(saved)),
        ("90 % credible set", free(", ".join(label_words(e) for e in saved.credible_set) or "not given")),
    ]
    if saved.shrink:
        rows.append(("Held out", free(tables.held_out_text(saved))))
    level = level_text(saved.level)
    return Facts([*rows, ("Intervals", f"central {level} credible intervals, written median [low, high]")])


def _record_list(saved):
    tips = [f" (±{r['amplitude_Nm']:.3g} N·m)" for r in saved.records]
    records = [x if "±" in x else x + tip for x, tip in zip(saved.labels, tips, strict=True)]
    more = f"; and {len(records) - LISTED} more" if len(records) > LISTED else ""
    return free(f"{len(records)}: {'; '.join(records[:LISTED])}{more}", 600)


def _details(saved, figures) -> list[Block]:
    def pictures(kind):
        return [Picture(n, caption(n, saved.level)) for n in figures if n == kind or n.startswith(f"{kind}-")]

    parts = (
        ("Which effect", [*tables.probabilities(saved), *tables.effect_parameters(saved)]),
        ("Where the gap lies", [*_summary(saved), *pictures("gap-map"), *pictures("gap-residual")]),
        ("How far it shrinks", [*tables.shrink(saved), *pictures("closed-fraction")]),
        ("What it changes", [*tables.indicators(saved), *tables.parameter_shift(saved), *pictures("parameter-shift")]),
        ("Next test", next_test(saved)),
        ("Convergence", tables.convergence(saved)),
        ("Terms", [Facts(TERMS)] if saved.result["which"] else []),
    )
    return [b for name, blocks in parts if blocks for b in (Heading(name), *blocks)]


def _summary(saved):
    return [Paragraph(free(saved.summary, 600))] if saved.summary else []
