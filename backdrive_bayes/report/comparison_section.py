"""The chapter of a comparison: what differs between units and by how much, and how each releases energy."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.figures.catalogue import caption, comparison_figures
from backdrive_bayes.figures.style import indicator_words, loop_words, shortened, shown_unit
from backdrive_bayes.number_text import ENDS, interval_text, level_text, marked, probability_text
from backdrive_bayes.report.blocks import Banner, Chapter, Facts, Heading, Note, Paragraph, Picture, Signature, Table
from backdrive_bayes.report.claims_section import claims
from backdrive_bayes.report.findings import PROVISIONAL, findings_blocks, warned
from backdrive_bayes.report.sentences import sentence
from backdrive_bayes.report.text import Free, digests, free
from backdrive_bayes.results import COMPARISON, read_result

KEY = ("lost_motion_rad", "zero_torque_width_rad", "peak_angle_rad", "loop_area_J", "absorbed_J", "dissipation_ratio")
DEFAULT_RATE = 0.05
"""Rate of the summary's condition, where it was measured [N·m/s]."""


def chapter(folder: Path) -> Chapter:
    """Read a result folder of ``compare`` and lay out its pages."""
    result = read_result(Path(folder) / "comparison.json", COMPARISON)
    figures = comparison_figures(result)
    level = result["level"]
    title = free("Comparison: " + ", ".join(result["names"]), 110)
    ratios = [n for n in figures if n.startswith("comparison-ratios")]
    loops = [n for n in figures if n.startswith("comparison-loops")]
    names = [n for n in (*loops, *ratios, "comparison-mechanism") if n in figures]
    return Chapter(
        title,
        [
            Heading(title, 1),
            _banner(result),
            *findings_blocks(result),
            _identity(result),
            *_key_tables(result),
            *(Picture(n, caption(n, level)) for n in names),
            Signature(["Reviewed by", "Date", "Signature"]),
        ],
        [
            *(Picture(n, caption(n, level), spilt=True) for n in names),
            *_refused(result),
            *_reproduction(result),
        ],
        figures,
        pages=claims(result),
        outcome=", ".join(filter(None, [_outcome(result), warned(result)])),
        provisional=not _usable(result),
    )


def _outcome(result):
    rows = [r for p in result["pairs"] for c in p["conditions"] for r in c["indicators"].values()]
    clear = sum(r["verdict"] in ("greater", "less") for r in rows)
    text = f"{clear} of {len(rows)} differences are clear"
    if result["outcome"]["exit_code"]:
        text = f"{result['outcome']['word'].upper()}; {text}"
    found = (result["claims"] or {}).get("claims", [])
    counts = [f"{sum(c['verdict'] == v for c in found)} {v}" for v in ("holds", "does not hold", "open") if found]
    return f"{text}; claims: {', '.join(counts)}" if found else text


def _banner(result):
    rows = [r for p in result["pairs"] for c in p["conditions"] for r in c["indicators"].values()]
    outcome = result["outcome"]
    if outcome["exit_code"]:
        reason = free(outcome["reason"], 400).rstrip(".")
        tone = "caution" if len(_usable(result)) > 1 else "bad"
        return Banner(tone, outcome["word"].upper(), f"{reason[:1].upper()}{reason[1:]}.")
    clear = sum(r["verdict"] in ("greater", "less") for r in rows)
    same = sum(r["verdict"] == "equivalent" for r in rows)
    text = (
        f"Comparisons of an indicator at one rate and amplitude: {len(rows)}. Clearly different: {clear}; equivalent within "
        f"±{100 * result['rope']:.3g} %: {same}; undecided: {len(rows) - clear - same}; each at a probability of "
        f"{100 * result['clear']:.3g} %."
    )
    pairs, compared = len(result["pairs"]), sum(bool(p["conditions"]) for p in result["pairs"])
    if compared < pairs:
        text = f"Of {pairs} pairs of units {compared} had a rate and an amplitude in common. {text}"
    if any(c.get("predicted") for p in result["pairs"] for c in p["conditions"]):
        text += " Where one of the two was measured further only, its smaller loop is predicted."
    return Banner("good", "COMPARED at matched rate and amplitude", text)


def _usable(result) -> set[str]:
    """Names of the units whose sampling converged, on data that were not forced."""
    units = zip(result["names"], result["units"], strict=True)
    return {n for n, unit in units if (unit.get("convergence") or {}).get("converged") and not unit.get("forced")}


def _identity(result):
    rows = []
    for name, unit, fit in zip(result["names"], result["units"], result["reproduction"], strict=True):
        known = unit.get("identity") or {}
        about = free("; ".join(str(known[k]) for k in ("description", "origin") if known.get(k)), 200)
        digest = fit.get("data_sha256")
        rows.append((free(shortened(name)), Free("; ".join(filter(None, [about, digest and f"data SHA-256 {digests(digest)}"])))))
    return Facts(rows)


def _key_tables(result):
    """The six key indicators of every pair at one condition, for at most two pairs."""
    blocks = []
    # Pairs that may be used come first.
    ordered = sorted(result["pairs"], key=lambda p: not {p["first"], p["second"]} <= _usable(result))
    for pair in [p for p in ordered if p["conditions"]][:2]:
        best = min(pair["conditions"], key=_from_default)
        heading = Heading(f"{free(pair['first'], 40)} and {free(pair['second'], 40)} at {_at(best)}")
        blocks += [heading, _table(pair, best, KEY, _usable(result))]
    return [*blocks, Note(_legend(result))]


def _from_default(condition):
    """The largest amplitude first, then the rate nearest to the default one."""
    return -float(f"{condition['amplitude_Nm']:.2g}"), abs(condition["loading_rate_Nm_per_s"] - DEFAULT_RATE)


def _legend(result):
    marks = f" {PROVISIONAL}" if len(_usable(result)) < len(result["names"]) else ""
    return (
        f"Median [{level_text(result['level'])} interval]. Ratio: first over second; where not all draws of both are "
        "positive, the difference first minus second. “Greater” and “less” are said of the first, "
        f"where it differs by more than {100 * result['rope']:.3g} % with a probability of {100 * result['clear']:.3g} %. "
        f"P: the probability that the first is larger at all.{marks}"
    )


def _at(condition):
    predicted = f", predicted for {free(' and '.join(condition['predicted']), 60)}" if condition.get("predicted") else ""
    return f"{loop_words(condition)}{predicted}"


def _table(pair, condition, names, usable):
    rows, provisional = [], [pair[k] not in usable for k in ("first", "second")]
    for name in (n for n in names if n in condition["indicators"]):
        row = condition["indicators"][name]
        factor, unit = shown_unit(row["unit"], [row[k][end] for k in ("first", "second") for end in ENDS])
        rows.append(
            [
                f"{indicator_words(name)} [{unit or '–'}]",
                *(marked(interval_text(row[k], factor), d) for k, d in zip(("first", "second"), provisional, strict=True)),
                _ratio_cell(row, factor, unit, any(provisional)),
                probability_text(row["probability_first_greater"]),
                row["verdict"],
            ]
        )
    columns = ["Indicator", free(shortened(pair["first"])), free(shortened(pair["second"])), "Ratio", "P", "Verdict"]
    return Table(columns, rows, [4.0, 3.16, 3.16, 3.62, 1.3, 1.76])


def _ratio_cell(row, factor, unit, provisional):
    """The ratio, or the difference where one of the two may be zero or change its sign."""
    if row["ratio"]:
        return marked(interval_text(row["ratio"]), provisional)
    return [marked(interval_text(row["difference"], factor), provisional), f"difference [{unit or '–'}]"]


def _refused(result):
    rows = [
        [free(r["unit"], 40), free(r["record"], 60), free(r["against"], 40), sentence(r["reason"])]
        for p in result["pairs"]
        for r in p["refused"]
    ]
    rows += [
        [free(p["first"], 40), f"{indicator_words(name)} at {loop_words(c)}", free(p["second"], 40), sentence(reason)]
        for p in result["pairs"]
        for c in p["conditions"]
        for name, reason in (c.get("not_compared") or {}).items()
    ]
    if not rows:
        return []
    return [
        Heading("Not compared"),
        Paragraph("An amplitude within the measured one can be predicted, a rate that was not measured cannot."),
        Table(["Unit", "Loop or indicator", "against", "Reason"], rows, [0.9, 1.2, 0.9, 2.4]),
    ]


def _reproduction(result):
    fits = zip(result["names"], result["reproduction"], strict=True)
    rows = [
        f"{free(shortened(n))}: seed {f.get('seed', '–')}, data SHA-256 {digests(f.get('data_sha256') or '–')}" for n, f in fits
    ]
    versions = sorted({str(f["versions"]) for f in result["reproduction"] if "versions" in f})
    return [Note(f"Reproduction. {'; '.join([*rows, *versions])}. All conditions and indicators are in comparison.json.")]
