"""Claims with their probabilities, the numbers behind them and plain verdicts."""

from __future__ import annotations

from backdrive_bayes.figures.style import display_unit
from backdrive_bayes.report.blocks import Heading, Note, Paragraph, Table
from backdrive_bayes.report.numbers import interval_text, probability_text, significant
from backdrive_bayes.report.text import free

MOST_NUMBERS = 3
"""Numbers behind a claim that are printed; all are in comparison.json."""


def claims(result) -> list:
    """The claims of a comparison; nothing where none were asked."""
    found = result["claims"]
    if not found:
        return []
    source = f" Source: {free(found['source'])}." if found["source"] else ""
    letters = ", ".join(f"{free(letter, 12)} is {free(name, 60)}" for letter, name in found["units"].items())
    return [
        Heading("Claims"),
        Paragraph(f"Each claim is a question to the posteriors, answered with a probability. {letters}.{source} {_count(found)}"),
        Table(_COLUMNS, [_row(c) for c in found["claims"]], _WIDTHS),
        Note(
            f"“Holds” from a probability of {found['holds_from']:g}, “does not hold” up to {found['fails_below']:g}, “open” "
            "between. Numbers: median [90 % interval] at the first rate asked; of a series the medians at its ends and its "
            "largest. Loops of amplitudes that were not measured are predictions, widened by the error that measured ones show."
        ),
    ]


_COLUMNS = ["No.", "Claim and predicate", "Numbers behind it", "Probability", "Verdict"]
_WIDTHS = [0, 2.6, 1.6, 0.75, 0.8]


def _count(found):
    verdicts = [c["verdict"] for c in found["claims"]]
    words = ("holds", "does not hold", "open", "inconclusive", "not answered")
    counted = [(w, verdicts.count(w)) for w in words if w in verdicts]
    return "Of " + str(len(verdicts)) + " claims: " + ", ".join(f"{n} {w}" for w, n in counted) + "."


def _row(claim):
    verdict = [claim["verdict"], free(claim["reason"])] if claim["reason"] else claim["verdict"]
    probability = "–" if claim["probability"] is None else probability_text(claim["probability"])
    note = f" ({free(claim['note'])})" if claim["note"] else ""
    asked = [free(claim["claim"]), free(claim["asked"] + note, 420)]
    return [free(claim["id"], 8), asked, _numbers(claim), probability, verdict]


def _numbers(claim):
    shown = claim["numbers"]
    if not shown:
        return "–"
    shown = [n for n in shown if n["at"] == shown[0]["at"]][:MOST_NUMBERS]
    return "; ".join(_number(n) for n in shown)


def _number(number):
    factor, unit = display_unit(number["unit"])
    if isinstance(number["median"], list):
        first, *_, last = number["median"]
        ends = f"{significant(first, 3, factor)} to {significant(last, 3, factor)}"
        top = max(number["median"])
        over = f", at most {significant(top, 3, factor)}" if top > 1.05 * max(first, last) else ""
        return f"{ends}{over} {unit}".rstrip()
    return f"{interval_text(number, factor)} {unit}".rstrip()
