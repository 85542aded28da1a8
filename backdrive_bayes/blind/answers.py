"""The answers of a diagnosis, as a blind check reads them from files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.blind.key import label_of
from backdrive_bayes.results import read_result

ANSWER_SCHEMA = "backdrive-bayes/blind-answer/1"


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of one unit; ``label`` is None where it failed or was inconclusive, with the reason in ``error``.

    ``probabilities`` and ``credible`` go by the labels of :func:`label_of`; ``gap`` is the probability of a gap; ``cells`` are
    the objects of where.map; ``closed`` is the median closed fraction.
    """

    label: str | None
    error: str | None = None
    probabilities: dict[str, float] | None = None
    credible: tuple[str, ...] = ()
    gap: float | None = None
    cells: tuple[dict, ...] = ()
    closed: float | None = None

    @property
    def top(self) -> str | None:
        """The most probable label."""
        return max(self.probabilities, key=self.probabilities.__getitem__) if self.probabilities else None


def read_answer(path: Path) -> Answer:
    """An answer's file; one that cannot be understood is an answer that failed."""
    kept = read_result(path, ANSWER_SCHEMA)
    if "diagnosis" not in kept:
        return Answer(None, kept.get("error") or "no answer")
    return understand(kept["diagnosis"])


def understand(diagnosis: dict) -> Answer:
    """The object of diagnosis.json as an :class:`Answer`."""
    try:
        convergence = diagnosis.get("convergence") or {}
        reason = diagnosis.get("inconclusive") or (convergence.get("converged") is False and "its sampling has not converged")
        if reason:
            return Answer(None, f"inconclusive: {reason}")
        probabilities = _probabilities(diagnosis["which"])
        answer, where, shrink = diagnosis["answer"], diagnosis.get("where") or {}, diagnosis.get("shrink") or {}
        return Answer(
            label_of(answer["effects"]),
            None,
            probabilities,
            tuple(canonical(item) for item in answer["credible_set_90"]),
            _number(diagnosis["gap"]["probability"]),
            tuple(where.get("map") or ()),
            _number((shrink.get("closed_fraction") or {}).get("median")),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        return Answer(None, f"not a diagnosis: {type(error).__name__} {error}")


def canonical(item) -> str:
    """The label of a name, of names joined by '+', or of a list of names."""
    names = item.split("+") if isinstance(item, str) else item
    return label_of(name.strip() for name in names)


def _probabilities(which):
    found: dict[str, float] = {}
    for entry in which:
        label, p = canonical(entry["effect"]), float(entry["probability"])
        if not 0.0 <= p <= 1.0 + 1e-6:
            raise ValueError(f"probability {p} of {label}")
        found[label] = found.get(label, 0.0) + p
    if abs(sum(found.values()) - 1.0) > 0.01:
        raise ValueError(f"probabilities that sum to {sum(found.values()):.3g}")
    return found


def _number(value):
    return float(value) if value is not None and math.isfinite(value) else None
