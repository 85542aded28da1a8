"""Claims with their probabilities, the numbers behind them and plain verdicts."""

from __future__ import annotations

import re

from backdrive_bayes.figures.style import shown_unit
from backdrive_bayes.number_text import interval_text, probability_text, significant
from backdrive_bayes.report.blocks import Heading, Note, Paragraph, Table
from backdrive_bayes.report.sentences import sentence
from backdrive_bayes.report.text import free

_LETTER = re.compile(r"\b([A-Za-z]\w*)\.[A-Za-z]")
MOST_NUMBERS = 1
"""Numbers behind a claim that are printed; all are in comparison.json, with the predicates."""


def claims(result) -> list:
    """The claims of a comparison; nothing where none were asked."""
    found = result["claims"]
    if not found:
        return []
    source = f" Source: {free(found['source'])}." if found["source"] else ""
    letters = ", ".join(f"{free(letter, 12)} is {free(name, 60)}" for letter, name in found["units"].items())
    return [
        Heading("Claims", 1),
        Paragraph(f"Each claim is a question to the posteriors, answered with a probability. {letters}.{source} {_count(found)}"),
        *_origins(result),
        Table(_COLUMNS, [_row(c) for c in found["claims"]], _WIDTHS),
        Note(
            f"✓ holds, from a probability of {found['holds_from']:g}; ✗ does not hold, up to {found['fails_below']:g}; "
            "– open between, or not answered. Numbers: median [90 % interval] at the first rate asked, of a series the medians "
            "at its ends and its largest; all of them, with the predicates, are in comparison.json."
        ),
    ]


_COLUMNS = ["No.", "Claim", "Numbers behind it", "", "Verdict"]
_WIDTHS = [0, 2.6, 1.75, 0, 1.25]
_TICKS = {"holds": "✓", "does not hold": "✗"}
NOTHING = 1e-6
"""Beside the largest of a series, values below this share of it are nothing."""


def _origins(result) -> list:
    """Where the units come from, where they say so: of a synthetic one a claim that holds tests the evaluation alone."""
    origins = [(unit.get("identity") or {}).get("origin") for unit in result["units"]]
    told = [f"{free(n, 40)}: {free(o, 200)}" for n, o in zip(result["names"], origins, strict=True) if o]
    return [Paragraph(f"Origin of the units. {'; '.join(told)}.")] if told else []


def _count(found):
    verdicts = [c["verdict"] for c in found["claims"]]
    counts = [(verdicts.count(verdict), said) for verdict, said in _SAID.items()]
    told = [f"{n} {one if n == 1 else more}" for n, (one, more) in counts if n]
    return f"Of {len(verdicts)} {'claims' if len(verdicts) != 1 else 'claim'}, {', '.join(told)}."


_SAID = {
    "holds": ("holds", "hold"),
    "does not hold": ("does not hold", "do not hold"),
    "open": ("is open", "are open"),
    "inconclusive": ("is inconclusive", "are inconclusive"),
    "not answered": ("was not answered", "were not answered"),
}
"""Verdict → how it is said of one claim and of several."""


def _row(claim):
    said = claim["verdict"]
    if claim["probability"] is not None:
        said = f"{said}, {probability_text(claim['probability'])}"
    return [free(claim["id"], 8), sentence(claim["claim"]), _numbers(claim), _TICKS.get(claim["verdict"], "–"), said]


def _numbers(claim):
    found = claim["numbers"]
    shown = [n for n in found if n["at"] == found[0]["at"]][:MOST_NUMBERS]
    texts = "; ".join(_whose(n) + _number(n) for n in shown)
    return texts or sentence(claim["reason"]) or "–"


def _whose(number):
    """The letter of the unit, where a number is one unit's."""
    letters = set(_LETTER.findall(number["what"]))
    return f"{letters.pop()} " if len(letters) == 1 else ""


def _number(number):
    median = number["median"]
    factor, unit = shown_unit(number["unit"], median if isinstance(median, list) else [median, number["lo"], number["hi"]])
    if isinstance(median, list):
        top, size = max(median), max(abs(v) for v in median)
        first, *_, last = (v if abs(v) > NOTHING * size else 0.0 for v in median)
        ends = f"{significant(first, 3, factor)} to {significant(last, 3, factor)}"
        over = f", at most {significant(top, 3, factor)}" if top > 1.05 * max(first, last) else ""
        return f"{ends}{over} {unit}".rstrip()
    return f"{interval_text(number, factor)} {unit}".rstrip()
