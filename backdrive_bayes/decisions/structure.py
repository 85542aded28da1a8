"""Structure counts: which share of probability the models at hand cover, and what a gap diagnosis leaves unexplained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import OPERATOR_PROPERTIES

SMALL = 1e-3
"""A probability that is not worth a word."""
UNLISTED = "unknown"
"""The name under which a diagnosis holds what it does not list."""
NO_VERDICT = "inconclusive diagnosis"
"""What stands for the causes that a diagnosis without a verdict leaves open."""


@dataclass(frozen=True, eq=False)
class Model:
    """One model of a unit that stays probable: its draws and its probability."""

    evidence: Evidence
    probability: float


@dataclass(frozen=True, eq=False)
class Structure:
    """The models that are averaged over, and what none of them holds: probabilities by effect."""

    models: tuple[Model, ...]
    uncovered: dict[str, float]
    diagnosed: bool

    @property
    def unknown(self) -> float:
        """Probability that something acts which no model at hand holds."""
        return float(min(1.0, sum(self.uncovered.values())))

    def average(self, values) -> float:
        """Mean of one number a model, with their probabilities; what is uncovered adds nothing."""
        return float(sum(m.probability * v for m, v in zip(self.models, values, strict=True)))

    def to_json(self) -> dict:
        """As saved."""
        models = [m.evidence.about["model"] | {"probability": m.probability} for m in self.models]
        return {
            "diagnosed": self.diagnosed,
            "models": models,
            "uncovered": self.uncovered,
            "unknown_probability": self.unknown,
        }


def weigh(evidences, probabilities=None) -> Structure:
    """Models of one unit with their probabilities.

    ``probabilities`` are given for several models, at most 1 in all, as shares of what a diagnosis leaves to them; what they
    leave over belongs to no model. A single model (None) has all of it. BadInput where they do not fit.
    """
    evidences = list(evidences)
    diagnosis = next((e.diagnosis for e in evidences if e.diagnosis), None)
    if probabilities is None and len(evidences) > 1:
        raise BadInput("models", "a probability for each of several models of a unit", "none")
    given = [1.0] if probabilities is None else [float(p) for p in probabilities]
    _require_one_unit(evidences, given)
    uncovered = _uncovered(diagnosis, set().union(*(e.effects for e in evidences)))
    held = 1.0 - min(1.0, sum(uncovered.values()))
    if (left := 1.0 - sum(given)) > SMALL:
        uncovered |= {"models not given": left * held}
    models = tuple(Model(e, p * held) for e, p in zip(evidences, given, strict=True))
    return Structure(models, uncovered, diagnosis is not None)


def _require_one_unit(evidences, probabilities) -> None:
    good = len(probabilities) == len(evidences) and all(0 <= p <= 1 for p in probabilities) and 0 < sum(probabilities) <= 1 + 1e-6
    if not good:
        shown = ", ".join(f"{p:g}" for p in probabilities)
        raise BadInput("models", "one probability a model, between 0 and 1 and at most 1 in all", shown)
    if len({e.name for e in evidences}) > 1:
        raise BadInput("models", "several models of one unit", " and ".join(sorted({e.name for e in evidences})))
    for other in evidences[1:]:
        if other.about["data_sha256"] != evidences[0].about["data_sha256"]:
            raise BadInput("models", f"several models of the same records of {evidences[0].name}", "fits of different data")


def _uncovered(diagnosis, held: set[str]) -> dict[str, float]:
    """Probabilities, by answer of a diagnosis, of all in which something acts that it answers with and neither the models nor the
    class itself hold."""
    if diagnosis is None:
        return {}
    try:
        found = {str(w["effect"]): float(w["probability"]) for w in diagnosis["which"]}
        answer = [str(name) for name in diagnosis["answer"]["effects"]]
        # What acts unlisted beside a named module is held by no model either.
        unlisted = float((diagnosis.get("gap") or {}).get("unlisted_probability", 0.0))
    except (KeyError, TypeError, ValueError) as error:
        wanted = "which[].effect, which[].probability and answer.effects"
        raise BadInput("diagnosis.json", wanted, f"{type(error).__name__} {error}") from None
    if not all(np.isfinite(p) and 0 <= p <= 1 + 1e-9 for p in (*found.values(), unlisted)):
        raise BadInput("diagnosis.json", "probabilities between 0 and 1", str(found | {"unlisted": unlisted})[:80])
    covered = {*held, *OPERATOR_PROPERTIES, *BASELINE, "none"}
    # A fit averages over what may act; what its diagnosis answers with and it does not hold speaks against either decision.
    missing = {name for name in answer if name not in covered} | ({UNLISTED} if unlisted > 0.5 else set())
    if silent := missing - {UNLISTED}.union(*(label.split("+") for label in found)):
        raise BadInput("diagnosis.json", "a probability of whatever it answers with", f"none of {', '.join(sorted(silent))}")
    out = {label: p for label, p in found.items() if missing & set(label.split("+"))}
    if UNLISTED in missing and (rest := unlisted - sum(p for label, p in out.items() if UNLISTED in label.split("+"))) > SMALL:
        out[UNLISTED] = out.get(UNLISTED, 0.0) + rest
    return out | ({NO_VERDICT: 0.5} if diagnosis.get("inconclusive") else {})
