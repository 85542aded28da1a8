"""Where the gap lies and how far it was closed, against the truth and against an oracle that knows the effect."""

from __future__ import annotations

import functools

from backdrive_bayes.bench.registry import NONE, UNKNOWN
from backdrive_bayes.blind.answers import Answer
from backdrive_bayes.blind.case import Case, by_severity
from backdrive_bayes.blind.intervals import mean_of, share
from backdrive_bayes.blind.where import overlap

NEAR = 0.1
"""Difference of two closed fractions that counts as none."""


def where_scores(cases: list[Case]) -> dict:
    """Overlap of where, of units with an effect, against both truths; ``with_zeros`` counts a missing map as no overlap."""
    return {
        name: _where(cases, name) | {"by_severity": by_severity(cases, functools.partial(_where, truth=name))}
        for name in ("remainder", "effect")
    }


def unit_overlap(case: Case, truth: str) -> float | None:
    """Overlap of one unit with the map of one truth, 'remainder' or 'effect'."""
    return overlap(case.entry["where"][truth], case.answer.cells)


def _where(cases, truth):
    found = [unit_overlap(c, truth) for c in cases if c.entry["where"][truth] is not None]
    return mean_of(v for v in found if v is not None) | {"with_zeros": mean_of(v or 0.0 for v in found)}


def closed_scores(cases: list[Case], oracle: dict[str, Answer]) -> dict:
    """Closed fractions of units with an effect; where an oracle was asked, both beside each other."""
    acting = [c for c in cases if c.label != NONE]

    def scores(own):
        both = [(c.answer.closed, oracle[c.entry["unit"]].closed) for c in own if c.entry["unit"] in oracle]
        known = [(a, b) for a, b in both if a is not None and b is not None]
        return {
            "closed_fraction": mean_of(c.answer.closed for c in own if c.answer.closed is not None),
            "oracle": mean_of(b for _, b in known),
            "same_units": mean_of(a for a, _ in known),
            "difference": mean_of(abs(a - b) for a, b in known),
            "near_oracle": share(abs(a - b) <= NEAR for a, b in known),
            "not_compared": len(both) - len(known),
        }

    return scores(acting) | {"by_severity": by_severity(acting, scores)}


def removed_scores(cases: list[Case]) -> dict:
    """Units diagnosed with their effects taken out of the library: called unknown, another effect named, where it lies."""

    def scores(own):
        return {
            "unknown": share(c.answer.label == UNKNOWN for c in own),
            "nothing": share(c.answer.label == NONE for c in own),
            "misnamed": share(c.names_effect for c in own),
            "where": _where(own, "remainder"),
        }

    return scores(cases) | {"by_severity": by_severity(cases, scores)}
