"""How a result came out: one function for the exit code, the screen, the JSON file and the PDF."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from backdrive_bayes.decisions.conformance import Verdict
from backdrive_bayes.results import BLIND, CHECK, COMPARISON, DIAGNOSIS, FLEET, INDICATORS, POOL, PREDICTION, VERDICT

FORCED = "forced: the data are unfit, nothing that rests on them is to be trusted"
UNEXAMINED = (
    "structure was not examined: an effect that acts beside the model may hide in the data and shift every number judged here "
    "(accept of the unit's folder, or a diagnosis beside the fit, examines it)"
)
UNFIT, INCONCLUSIVE = 2, 4


@dataclass(frozen=True)
class Outcome:
    """One ``word``, a ``caveat`` that is shown with it everywhere, the ``reason``, and the exit code of the verb."""

    word: str
    reason: str = ""
    exit_code: int = 0
    caveat: str = ""

    def to_json(self) -> dict:
        """As every result file carries it."""
        return asdict(self)


def line(outcome: dict) -> str:
    """The outcome's first line on screen, from its JSON form."""
    told = [part for part in (outcome["caveat"], outcome["reason"]) if part]
    return f"{outcome['word'].upper()}{': ' if told else ''}{'; '.join(told)}"


def outcome_of(result: dict) -> Outcome:
    """The outcome of a result object of any schema."""
    found = _OF[result["schema"]](result)
    caveats = [FORCED if result.get("forced") else "", found.caveat]
    return Outcome(found.word, found.reason, found.exit_code, "; ".join(filter(None, caveats)))


def _sampled(word):
    def judge(result):
        convergence = result["convergence"]
        why = _doubts(convergence) if not convergence["converged"] else ""
        return Outcome("inconclusive", why, INCONCLUSIVE) if why else Outcome(word)

    return judge


def _doubts(convergence) -> str:
    """What speaks against a posterior."""
    contradicted = "; ".join(convergence.get("contradictions") or ())
    return f"contradicts the measurement: {contradicted}" if contradicted else convergence.get("advice") or "not converged"


def _diagnosis(result):
    if result["inconclusive"]:
        return Outcome("inconclusive", result["inconclusive"], INCONCLUSIVE)
    return _sampled("diagnosed")(result)


def _verdict(result):
    verdict = Verdict(result["verdict"])
    caveat = "" if result["structure"]["diagnosed"] else UNEXAMINED
    return Outcome(verdict.value, result["reason"], verdict.exit_code, caveat)


def _comparison(result):
    units = zip(result["names"], result["units"], strict=True)
    lacking = [name for name, unit in units if not unit["convergence"]["converged"]]
    if not lacking:
        return Outcome("compared")
    reason = f"the fits of {', '.join(lacking)} are not to be used, nor any comparison or claim with them"
    if len(result["names"]) - len(lacking) < 2:
        return Outcome("inconclusive", reason, INCONCLUSIVE)
    return Outcome("inconclusive in part", f"{reason}; those of the other units stand", INCONCLUSIVE)


def _check(result):
    return Outcome("sound" if result["may_infer"] else "unfit", result["reason"], 0 if result["may_infer"] else UNFIT)


def _blind(result):
    scored = [mark["met"] for mark in result["marks"] if mark["met"] is not None]
    return Outcome("scored", f"{sum(scored)} of {len(scored)} marks met")


def _fleet(result):
    counts = result["counts"]
    lacking = counts["units"] - counts["done"]
    if lacking:
        return Outcome("incomplete", f"{lacking} of {counts['units']} units have no result", INCONCLUSIVE)
    return Outcome("complete", f"all {counts['units']} units have a result")


def _pool(result):
    refused = [found for found in result["quantities"] if found["refused"]]
    shares = f", {len(refused)} refused" if refused else ""
    told = f"{len(result['quantities']) - len(refused)} indicators and parameters of {len(result['units'])} units{shares}"
    return Outcome("pooled", told)


_OF = {
    INDICATORS: _sampled("converged"),
    DIAGNOSIS: _diagnosis,
    VERDICT: _verdict,
    COMPARISON: _comparison,
    CHECK: _check,
    BLIND: _blind,
    FLEET: _fleet,
    POOL: _pool,
    PREDICTION: lambda result: Outcome("predicted", result["reason"], caveat=result["caveat"]),
}
