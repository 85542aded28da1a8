"""The verdict on a unit: accepted, rejected or inconclusive, with its risks, the limiting indicator and what to measure next."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.decisions.conformance import (
    Risks,
    Verdict,
    acceptance_interval,
    conformance_probability,
    guard_bands,
    monte_carlo_error,
    share,
)
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.global_risk import global_risks, process_of_units
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.decisions.loops import Loop, NotAvailable, find_loop, largest_loops
from backdrive_bayes.decisions.next_step import advice, repeats_to_settle
from backdrive_bayes.decisions.pool import Pool
from backdrive_bayes.decisions.structure import Structure, weigh
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import UNITS
from backdrive_bayes.results import VERDICT

BINS = 60
_EXPLAIN = "Fit with the effects that the diagnosis names, or give their models with --model."


@dataclass(frozen=True)
class Judged:
    """One limit at one loop, and the draws that tell of it under each model (draws,)."""

    limit: Limit
    loop: Loop
    values: tuple[np.ndarray, ...]

    @property
    def conformance(self) -> list[float]:
        """p_c under each model."""
        return [conformance_probability(v, self.limit.lo, self.limit.hi) for v in self.values]

    @property
    def inside(self) -> list[np.ndarray]:
        """Which draws conform, under each model."""
        return [(v >= self.limit.lo) & (v <= self.limit.hi) for v in self.values]


@one_thread()
def assess(evidences, limits: Limits, probabilities=None, batch=()) -> dict:
    """The verdict object of a unit from one or several models' draws.

    ``batch`` holds evidence of other units of the same process, or is a batch pooled, for global risks. Raises BadInput where
    a limit names a loop that was neither measured nor can be predicted.
    """
    structure = weigh(evidences, probabilities)
    judged = [j for limit in limits.limits for j in _judge(structure, limit, limits)]
    within = [_within(structure, j) for j in judged]
    together = Risks(structure.average(_together(structure, judged)), structure.unknown, min(within, default=1.0))
    verdict, reason = _verdict(structure, together, limits)
    rows = [_row(structure, j, w, limits, batch) for j, w in zip(judged, within, strict=True)]
    limiting = min(range(len(rows)), key=lambda i: (round(rows[i]["conformance_probability"], 4), _margin(rows[i])))
    first = structure.models[0].evidence
    return {
        "schema": VERDICT,
        "unit": first.name,
        "verdict": verdict.value,
        "reason": reason,
        "risk": {"consumer": limits.consumer, "producer": limits.producer},
        "conformance_probability": together.conformance,
        "specific_consumer_risk": together.consumer,
        "specific_producer_risk": together.producer,
        "limiting": {k: rows[limiting][k] for k in ("indicator", "loading_rate_Nm_per_s", "amplitude_Nm")},
        "next": _next(structure, verdict, rows, limiting, limits, together, judged[0].values[0].size),
        "limits": rows,
        "structure": structure.to_json(),
        "convergence": first.about["convergence"],
        "k": first.about["k"],
        "level": first.about["level"],
        "identity": first.about.get("identity") or {},
        "rated_torque_Nm": first.rated_torque,
        "reproduction": first.reproduction,
    }


def _judge(structure: Structure, limit: Limit, limits: Limits) -> list[Judged]:
    first = structure.models[0].evidence
    if limit.k is not None and abs(limit.k - first.about["k"]) > 1e-9:
        raise BadInput(limit.where, f"k = {first.about['k']:g}, at which the lost motion was taken", f"k = {limit.k:g}")
    loops = limited_loops(limit, first.measured)
    try:
        # A prediction is known for the kept draws only, and all limits are judged on the same draws.
        kept = any(x.amplitude is not None for x in limits.limits)
        values = [tuple(m.evidence.values(limit.indicator, loop, kept) for m in structure.models) for loop in loops]
    except NotAvailable as why:
        raise BadInput(limit.where, "an indicator that is defined there", str(why)) from None
    return [Judged(limit, loop, v) for loop, v in zip(loops, values, strict=True)]


def limited_loops(limit: Limit, measured) -> list[Loop]:
    """The loops for which a limit holds, out of those that were measured or lie within them.

    A limit that names no rate holds for the unit's largest loops, or at all rates at which its amplitude is known. BadInput
    where there is none.
    """
    top = largest_loops(measured)
    reach = limit.amplitude or max(x.amplitude for x in top)
    rates = [limit.rate] if limit.rate is not None else [x.rate for x in top if x.amplitude > 0.98 * reach] or [top[0].rate]
    try:
        return [find_loop(measured, rate, limit.amplitude) for rate in rates]
    except NotAvailable as why:
        raise BadInput(limit.where, "a loop that was measured or can be predicted", str(why)) from None


def _margin(row) -> float:
    """Distance of the median from the nearest limit in standard deviations, negative beyond it."""
    return min(row["median"] - row["min"], row["max"] - row["median"]) / (row["sd"] or 1e-300)


def _together(structure, judged) -> list[float]:
    """Probability under each model that all limits are kept at once."""
    return [share(np.logical_and.reduce([j.inside[i] for j in judged])) for i in range(len(structure.models))]


def _within(structure: Structure, judged: Judged) -> float:
    """Largest probability that a limit is kept where something acts that no model holds.

    Whatever acts was measured in S of a measured loop; other indicators, loops that were not measured, and what a diagnosis
    without a verdict leaves, may be anything.
    """
    diagnosis = structure.models[0].evidence.diagnosis or {}
    gap = {} if diagnosis.get("inconclusive") else diagnosis.get("gap") or {}
    if judged.loop.predicted or judged.limit.indicator != "loop_area_J" or not gap.get("rms_rad"):
        return 1.0
    worth = largest_enclosed_j(gap["rms_rad"], judged.loop.amplitude, structure.models[0].evidence.draws.travelled_nm)
    return max(conformance_probability(v, judged.limit.lo - worth, judged.limit.hi + worth) for v in judged.values)


def largest_enclosed_j(gap_rad: float, amplitude_nm: float, travelled_nm: float) -> float:
    """By how much the area of a loop can differ [J] where the angle differs by a root mean square ``gap_rad`` over the torque
    that all records travel, the loop among them (Cauchy and Schwarz): |∮ Δθ dτ| ≤ √(4 T ∮ Δθ² |dτ|) ≤ γ √(4 T L)."""
    return float(gap_rad * np.sqrt(4.0 * amplitude_nm * travelled_nm))


def _verdict(structure: Structure, risks: Risks, limits: Limits) -> tuple[Verdict, str]:
    bad = [m.evidence for m in structure.models if not m.evidence.converged]
    if bad:
        advised = bad[0].about["convergence"].get("advice") or "check the records"
        return Verdict.INCONCLUSIVE, f"the fit is not to be used: {advised}"
    if not all(m.evidence.usable for m in structure.models):
        return Verdict.INCONCLUSIVE, "the check finds the data unfit and was overruled: nothing is decided on them"
    verdict = risks.verdict(limits.consumer, limits.producer)
    if verdict is Verdict.ACCEPTED:
        return verdict, f"the risk that it is out of limits, {_p(risks.consumer)}, is at most the agreed {_p(limits.consumer)}"
    if verdict is Verdict.REJECTED:
        return verdict, f"the risk that it is within limits, {_p(risks.producer)}, is at most the agreed {_p(limits.producer)}"
    if structure.unknown > min(limits.consumer, limits.producer):
        names = ", ".join(f"{n.replace('_', ' ')} ({_p(p)})" for n, p in structure.uncovered.items())
        return verdict, f"a gap between model and data is not explained by the model at hand: {names}"
    return verdict, (
        f"out of limits with probability {_p(risks.consumer)}, within with {_p(risks.producer)}: neither is as small as agreed"
    )


def _p(probability: float) -> str:
    if probability < 0.001:
        return "below 0.1 %"
    return f"{100 * probability:.2g} %" if probability < 0.99 else f"{min(100 * probability, 99.9):.1f} %"


def _row(structure: Structure, judged: Judged, within: float, limits: Limits, batch) -> dict:
    """All numbers of one limit at one loop; medians and intervals are of the mixture of models."""
    limit, loop, first = judged.limit, judged.loop, structure.models[0].evidence
    mixed = _mixture(structure, judged.values)
    level = first.about["level"]
    low, median, high = (float(q) for q in np.quantile(mixed, [0.5 - level / 2, 0.5, 0.5 + level / 2]))
    risks = Risks(structure.average(judged.conformance), structure.unknown, within)
    effective = min(float(np.size(judged.values[0])), first.about["convergence"]["min_tail_ess"] or 1.0)
    upper, lower = guard_bands(mixed, limits.consumer)
    row = {
        "indicator": limit.indicator,
        "unit": UNITS[limit.indicator],
        "loading_rate_Nm_per_s": loop.rate,
        "amplitude_Nm": loop.amplitude,
        "predicted": loop.predicted,
        "min": limit.lo,
        "max": limit.hi,
        "median": median,
        "lo": low,
        "hi": high,
        "sd": float(np.std(mixed)),
        "conformance_probability": risks.conformance,
        "monte_carlo_error": monte_carlo_error(risks.conformance, effective),
        "specific_consumer_risk": risks.consumer,
        "specific_producer_risk": risks.producer,
        "verdict": risks.verdict(limits.consumer, limits.producer).value if first.usable else Verdict.INCONCLUSIVE.value,
        "guard_band": {"below_max": upper, "above_min": lower},
        "accept_median_between": _accepted(limit, mixed, limits.consumer),
        "naive": _naive(first, limit, loop),
        "histogram": _histogram(mixed),
    }
    return row | {"global": _global(row, first, limit, limits, batch)}


def _accepted(limit: Limit, values, consumer: float) -> list[float]:
    """Medians between which the draws would be accepted if they were moved as a whole, none where no median is; of two limits by
    the normal of their spread."""
    if np.isinf([limit.lo, limit.hi]).any():
        upper, lower = guard_bands(values, consumer)
        return [limit.lo + lower, limit.hi - upper]
    return list(acceptance_interval(float(np.std(values)) or 1e-300, limit.lo, limit.hi, 1 - consumer) or ())


def _mixture(structure, values, draws: int = 4000):
    """Equally weighted draws of the models' mixture, the same at every call."""
    if len(values) == 1:
        return values[0]
    total = sum(m.probability for m in structure.models)
    counts = [int(round(draws * m.probability / total)) for m in structure.models]
    return np.concatenate([np.quantile(v, (np.arange(n) + 0.5) / n) for v, n in zip(values, counts, strict=True) if n])


def _histogram(values):
    lo, hi = np.quantile(values, [0.0005, 0.9995])
    margin = 0.05 * (hi - lo) or 0.01 * abs(hi) or 1.0
    counts, edges = np.histogram(values, bins=BINS, range=(lo - margin, hi + margin))
    return {"edges": edges.tolist(), "counts": counts.tolist()}


def _naive(evidence: Evidence, limit: Limit, loop: Loop) -> dict:
    """What the classic evaluation would decide: its point estimate against the limit."""
    classic = (evidence.record_json(loop).get("least_squares") or {}).get("indicators") or {}
    value = None if loop.predicted else classic.get(limit.indicator)
    return {"value": value, "inside": None if value is None else bool(limit.lo <= value <= limit.hi)}


def _global(row, first: Evidence, limit: Limit, limits: Limits, batch) -> dict | None:
    """Global risks of this decision rule over units of the process, measured as this one was."""
    if (limit.process is None and not batch) or row["sd"] <= 0:
        return None
    accepted = acceptance_interval(row["sd"], limit.lo, limit.hi, 1 - limits.consumer)
    # An estimate is rejected where p_c is at most the producer's risk: outside the interval of larger p_c.
    kept = acceptance_interval(row["sd"], limit.lo, limit.hi, limits.producer) or (np.inf, -np.inf)
    rule = row["sd"], (limit.lo, limit.hi), accepted, kept
    if limit.process is None and isinstance(batch, Pool):
        taken = first.about["k"] * first.rated_torque
        pooled = batch.predictive(limit.indicator, row["loading_rate_Nm_per_s"], row["amplitude_Nm"], taken)
        told, units, found = pooled.to_json(), pooled.units, pooled.risks(*rule, first.about["level"])
    else:
        at = row["loading_rate_Nm_per_s"], row["amplitude_Nm"]
        process, units = (limit.process, 0) if limit.process else process_of_units(first, batch, limit.indicator, *at)
        told, found = process.to_json(), global_risks(process, *rule).to_json()
    return {"process": told, "batch_units": units, "uncertainty": row["sd"], "accepted": accepted} | found


def _next(structure, verdict, rows: list[dict], limiting: int, limits: Limits, together: Risks, draws: int) -> dict | None:
    """What to do after an inconclusive verdict, which rests on so many draws."""
    if verdict is not Verdict.INCONCLUSIVE:
        return None
    row, repeats = rows[limiting], None
    if not all(m.evidence.usable for m in structure.models):
        text = _unusable(structure)
    elif structure.unknown > min(limits.consumer, limits.producer):
        test = (structure.models[0].evidence.diagnosis or {}).get("next_test") or {}
        text = f"Explain the gap first. {test.get('do') or _EXPLAIN}"
    elif min(together.consumer, together.producer) <= (least := share(np.zeros(draws, bool))) * (1 + 1e-9):
        text = f"Agree on larger risks: {draws} draws tell none below {100 * least:.2g} %; none of them says otherwise."
    else:
        repeats = None if row["predicted"] else repeats_to_settle(rows, limits.consumer, limits.producer)
        text = advice(row, repeats)
    return {
        "indicator": row["indicator"],
        "loading_rate_Nm_per_s": row["loading_rate_Nm_per_s"],
        "amplitude_Nm": row["amplitude_Nm"],
        "repeats_in_all": repeats,
        "do": text,
    }


def _unusable(structure: Structure) -> str:
    if all(m.evidence.converged for m in structure.models):
        return "Mend what the check finds in the data, then fit them without --force."
    convergence = next(m.evidence.about["convergence"] for m in structure.models if not m.evidence.converged)
    if convergence.get("contradictions"):
        return "Check the records: the posterior contradicts what was measured, so the model does not fit these data."
    return "Check the records, and leave out those that differ most from the others: the sampling does not converge on them."
