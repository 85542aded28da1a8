"""Which effect was named: confusion, top-1, credible sets, false alarms, abstention."""

from __future__ import annotations

from backdrive_bayes.bench.registry import NONE, UNKNOWN
from backdrive_bayes.blind.case import Case, by_severity, severities
from backdrive_bayes.blind.intervals import macro_share, mean_of, share
from backdrive_bayes.blind.request import CLASSES, LISTED, PAIR

OTHER_PAIR, NO_ANSWER = "other pair", "no answer"
COLUMNS = (*CLASSES, OTHER_PAIR, NO_ANSWER)


def confusion(cases: list[Case]) -> dict:
    """Counts (truth × answer); the right pair counts under 'pair', any other set of two or more under 'other pair'."""
    counts = [[0] * len(COLUMNS) for _ in CLASSES]
    for case in cases:
        counts[CLASSES.index(case.klass)][COLUMNS.index(_column(case))] += 1
    return {"truth": list(CLASSES), "answer": list(COLUMNS), "counts": counts}


def _column(case):
    if case.answer.label is None:
        return NO_ANSWER
    if "+" in case.answer.label:
        return PAIR if case.right else OTHER_PAIR
    return case.answer.label if case.answer.label in COLUMNS else NO_ANSWER


def top_1(cases: list[Case]) -> dict:
    """Right answers: of all, macro over classes, by class, and by severity; ``reached`` leaves out effects short of theirs."""
    return {
        "all": share(c.right for c in cases),
        "macro": _macro(cases, CLASSES),
        "by_class": {name: share(c.right for c in cases if c.klass == name) for name in CLASSES},
        "by_severity": [_at_severity(cases, s) for s in severities(cases)],
    }


def _at_severity(cases, severity):
    own = [c for c in cases if c.severity == severity]
    return {
        "severity": severity,
        "macro": _macro([*own, *(c for c in cases if c.klass == NONE)], CLASSES),
        "listed": _macro(own, LISTED),
        "listed_reached": _macro([c for c in own if not c.limited], LISTED),
        "by_class": {name: share(c.right for c in own if c.klass == name) for name in CLASSES if name != NONE},
    }


def _macro(cases, classes):
    return macro_share([[c.right for c in cases if c.klass == name] for name in classes])


def power(cases: list[Case]) -> list[dict]:
    """By severity, of the listed single effects: a gap seen (probability above one half), the effect named, another named."""
    return by_severity(
        [c for c in cases if c.klass in LISTED],
        lambda own: {
            "gap_seen": share((c.answer.gap or 0.0) > 0.5 for c in own),
            "named": share(c.right for c in own),
            "misnamed": share(c.names_effect and not c.right for c in own),
        },
    )


def credible_sets(cases: list[Case]) -> dict:
    """Coverage and size of the 90 % sets; a case without an answer is not covered and has no size."""
    sizes = [len(c.answer.credible) for c in cases if c.answer.label is not None]
    return {
        **_sets(cases),
        "sizes": {str(k): sizes.count(k) for k in sorted(set(sizes))},
        "by_class": {name: _sets([c for c in cases if c.klass == name]) for name in CLASSES},
        "by_severity": by_severity(cases, _sets),
    }


def _sets(cases):
    return {
        "coverage": share(c.covered for c in cases),
        "size": mean_of(len(c.answer.credible) for c in cases if c.answer.label is not None),
    }


def false_alarms(cases: list[Case]) -> dict:
    """On answered units with nothing missing: anything named, a listed effect named, a gap believed in; the mean probability of
    none."""
    own = [c for c in cases if c.klass == NONE and c.answer.label is not None]
    return {
        "named": share(c.answer.label != NONE for c in own),
        "effect_named": share(c.names_effect for c in own),
        "gap": share((c.answer.gap or 0.0) > 0.5 for c in own),
        "probability_of_none": mean_of(c.answer.probabilities.get(NONE, 0.0) for c in own if c.answer.probabilities),
    }


def abstention(cases: list[Case]) -> dict:
    """On units with an effect outside the library: called unknown, by severity and by the effect that it was."""
    own = [c for c in cases if c.klass == UNKNOWN]
    names = sorted({name for c in own for name in c.planted})
    return {
        "unknown": share(c.answer.label == UNKNOWN for c in own),
        "by_severity": by_severity(own, lambda some: {"unknown": share(c.answer.label == UNKNOWN for c in some)}),
        "by_effect": {name: share(c.answer.label == UNKNOWN for c in own if name in c.planted) for name in names},
    }


def pairs(cases: list[Case]) -> dict:
    """On units with two effects: both named and no other; at least one of the two and no other."""
    own = [c for c in cases if c.klass == PAIR]
    return {
        "both": share(c.right for c in own),
        "one_or_both": share(set((c.answer.label or NONE).split("+")) <= set(c.label.split("+")) for c in own),
    }
