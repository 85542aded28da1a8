"""The chapter of a fit: summary page, then what stands behind it."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.catalogue import caption, figures_of
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import PER_FIGURE, record_labels, words
from backdrive_bayes.report import fit_tables as tables
from backdrive_bayes.report.blocks import (
    Banner,
    Block,
    Chapter,
    Facts,
    Heading,
    Paragraph,
    Picture,
    Signature,
)
from backdrive_bayes.report.classic_tables import least_squares
from backdrive_bayes.report.numbers import fixed, level_text
from backdrive_bayes.report.parameter_tables import parameters
from backdrive_bayes.report.text import digests, free

ON_SUMMARY = 2 * PER_FIGURE
"""Records whose indicators fit on the summary page."""
IN_PLACE = ("loop", "modules", "torque-energy", "corner")
"""Figures that stand where they are called for; those behind them let text go first and so keep their order."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``fit`` and lay out its pages."""
    saved = Saved.read(folder)
    figures = figures_of(saved)
    level = saved.indicators["level"]
    shown = ["loop"] if len(saved.records) <= PER_FIGURE else []
    rest = [name for name in figures if name not in shown]
    return Chapter(
        free(saved.indicators["unit"], 80),
        [
            Heading(free(saved.indicators["unit"], 80), 1),
            _verdict(saved),
            _identity(saved),
            Heading("Key indicators"),
            *tables.indicators(saved, ON_SUMMARY),
            *[Picture(name, caption(name, level)) for name in shown],
            Signature(["Reviewed by", "Date", "Signature"]),
        ],
        [*(Picture(name, caption(name, level), spilt=True) for name in shown), *_details(saved, rest)],
        figures,
    )


def _verdict(saved):
    found = saved.indicators["convergence"]
    numbers = (
        f"Largest R-hat {fixed(found['max_rhat'], 3)}; smallest effective sample size "
        f"{fixed(found['min_bulk_ess'], 0)} (bulk) and {fixed(found['min_tail_ess'], 0)} (tail)."
    )
    if found["converged"]:
        return Banner("good", "CONVERGED: the intervals may be used", numbers)
    why = found.get("contradictions") or [found.get("advice") or "check the records"]
    text = f"Do not use these intervals: {free('; '.join(why), 600).rstrip('.')}. {numbers}"
    title = "the fit contradicts the measurement" if found.get("contradictions") else "the sampling has not converged"
    return Banner("bad", f"INCONCLUSIVE: {title}", text)


def _identity(saved):
    about, attributes, records = saved.indicators, saved.attributes(), saved.records
    identity = dict(about.get("identity") or {})
    credit = [(key.capitalize(), free(identity.pop(key))) for key in ("credit", "license") if key in identity]
    rows = [
        ("Unit", free(about["unit"])),
        *((free(words(k).capitalize(), 20), free(v)) for k, v in identity.items()),
    ]
    if "rated_torque_nm" in attributes:
        rows.append(("Rated torque", f"{attributes['rated_torque_nm']:g} N·m"))
    rows += [
        ("Records", _record_list(records)),
        ("Model", " + ".join(words(m) for m in [*about["model"]["modules"], *about["model"]["effects"]])),
        ("Intervals", f"central {level_text(about['level'])} credible intervals, written median [low, high]"),
    ]
    if attributes.get("data_sha256"):
        rows.append(("Data, SHA-256", digests(attributes["data_sha256"].split(","))))
    return Facts(rows + credit)


def _record_list(records):
    labels = record_labels(records)
    more = f"; and {len(labels) - ON_SUMMARY} more" if len(labels) > ON_SUMMARY else ""
    return f"{len(labels)}, loaded at {'; '.join(labels[:ON_SUMMARY])}{more}"


def _details(saved, figures) -> list[Block]:
    level = saved.indicators["level"]

    def pictures(kind):
        names = [n for n in figures if n == kind or n.startswith(f"{kind}-")]
        return [Picture(n, caption(n, level), floats=kind not in IN_PLACE) for n in names]

    loops, corners = pictures("loop"), pictures("corner")
    more = tables.indicators(saved) if len(saved.records) > ON_SUMMARY else []
    return [
        *([Heading("Loops"), *loops] if loops else []),
        *([Heading("Indicators of all records"), *more] if more else []),
        Heading("Module decomposition"),
        *pictures("modules"),
        *tables.mechanism(saved),
        Heading("Torque–energy curve"),
        *pictures("torque-energy"),
        *tables.humps(saved),
        *tables.back_drive(saved),
        Heading("Loops of smaller amplitude"),
        *pictures("amplitude"),
        *tables.by_amplitude(saved),
        Heading("Diagnostics"),
        *tables.convergence(saved),
        *pictures("trace"),
        *pictures("predictive"),
        Heading("Parameters and priors"),
        *parameters(saved),
        *tables.noise(saved),
        *least_squares(saved),
        *_reproduction(saved),
        *([Heading("Pairs of parameters"), *corners] if corners else []),
    ]


def _reproduction(saved):
    attributes = saved.attributes()
    if not attributes:
        return []
    rows = [
        ("Software", attributes["versions"]),
        ("Sampler", f"{attributes['inference_library']} {attributes['inference_library_version']}"),
        ("Seed", str(attributes["seed"])),
        ("Data, SHA-256", attributes["data_sha256"] or "not recorded"),
        ("Evaluations", f"{saved.indicators['convergence']['evaluations']} of the marginal posterior density"),
    ]
    return [
        Heading("Reproduction"),
        Paragraph("The same data, versions and seed give the same result bit for bit."),
        Facts(rows),
    ]
