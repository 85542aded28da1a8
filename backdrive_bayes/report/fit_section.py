"""The chapter of a fit: summary page, then what stands behind it."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.catalogue import caption, figures_of
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import PER_FIGURE, loop_words, record_labels, words
from backdrive_bayes.number_text import fixed, level_text, plain
from backdrive_bayes.report import fit_tables as tables
from backdrive_bayes.report.blocks import (
    About,
    Banner,
    Block,
    Chapter,
    Facts,
    Heading,
    Note,
    Picture,
    Signature,
)
from backdrive_bayes.report.classic_tables import least_squares
from backdrive_bayes.report.findings import findings_blocks, warned
from backdrive_bayes.report.parameter_tables import meanings, parameters
from backdrive_bayes.report.text import digests, free
from backdrive_bayes.results import usable

ON_SUMMARY = 2 * PER_FIGURE
"""Records whose indicators fit on the summary page."""
LEFT_OUT = ("predictive", "torque-energy", "amplitude")
"""Figures that stand in the result folder only."""
UNTIL_CONVERGED = ("trace",)
"""Figures that the report shows only where the chain has not converged: else its numbers say it."""
FIRST_ONLY = ("loop", "modules")
"""Figures of which the report shows the first; those of further records stand in the result folder."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``fit`` and lay out its pages."""
    saved = Saved.read(folder)
    left_out = LEFT_OUT + UNTIL_CONVERGED * bool(saved.indicators["convergence"]["converged"])
    figures = figures_of(saved, lambda name: _shown(name, left_out))
    level = saved.indicators["level"]
    shown = ["loop"]
    rest = [name for name in figures if name not in shown]
    return Chapter(
        free(saved.indicators["unit"], 80),
        [
            Heading(free(saved.indicators["unit"], 80), 1),
            _verdict(saved),
            *findings_blocks(saved.indicators),
            _identity(saved),
            Heading("Key indicators"),
            *tables.indicators(saved, ON_SUMMARY),
            *[Picture(name, caption(name, level)) for name in shown],
            Signature(["Reviewed by", "Date", "Signature"]),
        ],
        [*(Picture(name, caption(name, level), spilt=True) for name in shown), *_details(saved, rest)],
        figures,
        outcome=", ".join(filter(None, [_outcome(saved), warned(saved.indicators)])),
        provisional=not usable(saved.indicators),
        terms=[Heading("Parameters and sampling"), Note(meanings(saved)), Note(tables.CRITERIA)],
        about=_about(saved),
    )


def _shown(name, left_out):
    kind = name.rstrip("0123456789").rstrip("-")
    return kind not in left_out and (kind not in FIRST_ONLY or name == kind)


def _outcome(saved):
    records = saved.records
    outcome = saved.indicators["outcome"]
    provisional = ", provisional" if outcome["exit_code"] else ""
    return f"{outcome['word'].upper()}{provisional}; {len(records)} record{'s'[: len(records) != 1]}"


def _about(saved) -> About:
    """Unit, bench and key indicators at the largest loop whose rate is nearest to the default one."""
    record = saved.records[saved.main_record]
    identity = saved.indicators.get("identity") or {}
    told = [(k, str(identity[k])) for k in ON_OVERVIEW if identity.get(k)]
    provisional, forced = not usable(saved.indicators), bool(saved.indicators.get("forced"))
    rows = [(n, unit, tables.indicator_text(key, record, factor, provisional)) for key, n, unit, factor in tables.INDICATORS]
    options = f"k {plain(saved.indicators['k'])}, {level_text(saved.indicators['level'])} intervals"
    loop = f"{loop_words(record)}, {options}"
    return About(str(saved.indicators["unit"]), told, loop, rows, ",".join(saved.indicators["data_sha256"]), provisional, forced)


ON_OVERVIEW = ("description", "serial", "bench", "operator", "test date", "test_date", "origin")
"""Keys of a unit's identity that the overview repeats, in this order."""


def _verdict(saved):
    found = saved.indicators["convergence"]
    numbers = (
        f"Largest R-hat {fixed(found['max_rhat'], 3)}; smallest effective sample size "
        f"{fixed(found['min_bulk_ess'], 0)} (bulk) and {fixed(found['min_tail_ess'], 0)} (tail)."
    )
    outcome = saved.indicators["outcome"]
    if usable(saved.indicators):
        return Banner("good", f"{outcome['word'].upper()}: the intervals may be used", numbers)
    why = "; ".join(filter(None, [outcome["caveat"], outcome["reason"]]))
    title = f"{outcome['word'].upper()}{', but forced' * saved.indicators.get('forced', False)}"
    return Banner("bad", title, f"Do not use these intervals: {free(why, 600).rstrip('.')}. {numbers}")


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

    def pictures(kind, floats=False):
        return [Picture(n, caption(n, level), floats) for n in figures if n == kind or n.startswith(f"{kind}-")]

    more = tables.indicators(saved) if len(saved.records) > ON_SUMMARY else []
    parts = (
        ("Indicators of all records", more),
        ("Module decomposition", [*pictures("modules"), *tables.mechanism(saved)]),
        ("Energy and back-drive", [*pictures("energy"), *tables.ranges(saved)]),
        ("Parameters", [*parameters(saved), *pictures("corner", floats=True)]),
        ("Classic least-squares fit", least_squares(saved)),
        ("Sampling and noise", [*tables.convergence(saved), *tables.noise(saved), *_reproduction(saved), *pictures("trace")]),
    )
    return [b for name, blocks in parts if blocks for b in (Heading(name), *blocks)]


def _reproduction(saved):
    attributes = saved.attributes()
    if not attributes:
        return []
    evaluations = saved.indicators["convergence"]["evaluations"]
    told = (
        f"Seed {attributes['seed']}; {evaluations} evaluations of the marginal posterior density by "
        f"{attributes['inference_library']} {attributes['inference_library_version']}. Software: {attributes['versions']}. "
        f"Data, SHA-256: {attributes['data_sha256'].replace(',', ', ') or 'not recorded'}."
    )
    return [Note(f"Reproduction: the same data, versions and seed give the same result bit for bit. {told}")]
