"""All scores of a blind check, from the key and the answers alone."""

from __future__ import annotations

from backdrive_bayes.blind import naming
from backdrive_bayes.blind.answers import Answer
from backdrive_bayes.blind.calibration import calibration
from backdrive_bayes.blind.case import Case, match
from backdrive_bayes.blind.intervals import LEVEL
from backdrive_bayes.blind.marks import judge_all
from backdrive_bayes.blind.shrinking import closed_scores, removed_scores, unit_overlap, where_scores


def score(
    key: dict, answers: dict[str, Answer], oracle: dict[str, Answer] | None = None, removed: dict[str, Answer] | None = None
) -> dict:
    """Scores ready for JSON; answers are keyed by unit, ``oracle`` and ``removed`` for some of the units.

    Shares come with counts and binomial intervals of ``interval_level``. Failed and inconclusive diagnoses count as wrong and not
    covered; they have no probabilities to calibrate and are listed in ``failures``.
    """
    cases, without = match(key, answers), match(key, removed or {})
    known = [c for c in cases if c.answer.probabilities]
    scores = {
        "interval_level": LEVEL,
        "counts": {"units": len(key["units"]), "answered": len(known), "failed": len(cases) - len(known)},
        "failures": [{"unit": c.entry["unit"], "error": c.answer.error} for c in cases if c.answer.label is None],
        "top_1": naming.top_1(cases),
        "pairs": naming.pairs(cases),
        "power": naming.power(cases),
        "confusion": naming.confusion(cases),
        "credible_sets": naming.credible_sets(cases),
        "calibration": calibration([c.answer.probabilities or {} for c in known], [c.label for c in known]),
        "false_alarms": naming.false_alarms(cases),
        "abstention": naming.abstention(cases),
        "where": where_scores(cases),
        "closed": closed_scores(cases, oracle or {}),
        "removed": removed_scores(without),
        "removed_failures": [{"unit": c.entry["unit"], "error": c.answer.error} for c in without if c.answer.label is None],
    }
    return {"marks": judge_all(scores)} | scores | {"units": [_row(c) for c in cases]}


def _row(case: Case) -> dict:
    """One line of the table of units."""
    answer = case.answer
    return {
        "unit": case.entry["unit"],
        "truth": case.label,
        "planted": case.planted,
        "severity": case.severity,
        "height": case.entry["height"],
        "limited": case.limited,
        "answer": answer.label,
        "top": answer.top,
        "probability_of_top": answer.probabilities[answer.top] if answer.probabilities and answer.top else None,
        "probability_of_truth": answer.probabilities.get(case.label, 0.0) if answer.probabilities else None,
        "credible_set_90": list(answer.credible),
        "gap_probability": answer.gap,
        "overlap": unit_overlap(case, "remainder"),
        "closed_fraction": answer.closed,
        "error": answer.error,
    }
