"""Realised consumer's and producer's risks of the acceptance verdict with known truth, beside the naive point decision.

    python studies/acceptance_risk.py --units 40 --workers 2 --out reports/acceptance-risk

Every unit's parameters are drawn about the usual ones and its records simulated with a bench's noise, without and with an effect
that the model does not hold (creep: part of the compliance answers late). Upper limits are then put around the true indicators,
up to four posterior standard deviations away on either side, as often within as out of limits. Written: acceptance_risk.json and
README.md.
Realised risks are those of the verdict: of the units accepted the share that is out of limits, of the units rejected the share
within. "near" counts only decisions whose stated risk is more than half the agreed one. The naive decision compares the classic
least-squares point estimate with the limit.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter
from scipy.stats import beta

from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, ramp, random_reducer, simulate_unit
from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.decisions.conformance import Risks, Verdict, conformance_probability
from backdrive_bayes.indicators.draws import CORE, IndicatorDraws, core_indicators
from backdrive_bayes.indicators.loop import Loops, torque_grid

RATED, RATE, K = 0.1, 0.05, 0.03
OFFSETS = np.linspace(-4, 4, 40)
"""Where limits are put about the truth, in posterior standard deviations; none exactly on it."""
CREEP_SHARE, CREEP_SECONDS = 0.08, 2.0
CONSUMER, PRODUCER = 0.05, 0.10
COMPLIANCE = 0.1
"""Of a usual reducer [rad/(N·m)]."""


def creep(time_s, torque_nm):
    """Delayed part of the deflection [rad], shape (samples,): a share of the compliance that answers with one time constant."""
    keep = np.exp(-(time_s[1] - time_s[0]) / CREEP_SECONDS)
    return CREEP_SHARE * COMPLIANCE * lfilter([1 - keep], [1, -keep], torque_nm)


def true_indicators(known: KnownReducer, delayed: bool) -> dict[str, float]:
    """Indicators of the noise-free settled loop at the records' rate, from a record of several cycles."""
    time_s, torque = ramp(RATED, RATE, legs=(1, *(-1, 1) * 4))
    angle = known.angle_rad(time_s, torque) + (creep(time_s, torque) if delayed else 0.0)
    n = int(round(2 * RATED / RATE * 1000))
    grid = torque_grid(RATED, (K * RATED, *known.reducer.knots * RATED))
    falling = np.interp(grid, torque[-2 * n - 1 : -n][::-1], angle[-2 * n - 1 : -n][::-1])
    rising = np.interp(grid, torque[-n - 1 :], angle[-n - 1 :])
    return {k: float(v[0]) for k, v in core_indicators(Loops(grid, rising[None], falling[None]), K * RATED).items()}


def one_unit(job) -> dict:
    """Fit one simulated unit; truth, thinned draws and the classic estimate of every indicator."""
    seed, delayed = job
    rng = np.random.default_rng([20261201, seed])
    known = random_reducer(rng)
    unit = simulate_unit(known, [(RATED, RATE)], BenchNoise(), rng)
    if delayed:
        record = unit.records[0]
        late = creep(*ramp(RATED, RATE))
        unit = replace(unit, records=(replace(record, angle_rad=record.angle_rad + late),))
    began = time.perf_counter()
    posterior, about = fit_unit(unit, FitOptions(k=K, seed=seed))
    draws, own = IndicatorDraws(posterior, K), posterior.records
    classic = about["records"][0]["least_squares"]["indicators"]
    truth = true_indicators(known, delayed)
    values = {name: np.sort(draws.values(name, own.rate_nm_per_s[0], own.amplitude_nm[0])) for name in CORE}
    thin = {name: v[:: max(1, v.size // 400)].tolist() for name, v in values.items()}
    found = {name: {"truth": truth[name], "draws": thin[name], "naive": classic[name]} for name in CORE}
    return {"seed": seed, "converged": posterior.converged, "seconds": time.perf_counter() - began, "indicators": found}


def decisions(result: dict, factor: float = 1.0) -> list[dict]:
    """Verdict and naive decision of one unit at limits around the truth; ``factor`` scales the posterior's width."""
    rows = []
    for found in result["indicators"].values():
        draws = np.asarray(found["draws"])
        width = draws.std()
        draws = np.median(draws) + factor * (draws - np.median(draws))
        for offset in OFFSETS:
            limit = found["truth"] + offset * width
            risks = Risks(conformance_probability(draws, hi=limit))
            verdict = risks.verdict(CONSUMER, PRODUCER) if result["converged"] else Verdict.INCONCLUSIVE
            naive = None if found["naive"] is None else bool(found["naive"] <= limit)
            stated = {"accepted": risks.consumer, "rejected": risks.producer}.get(verdict.value)
            rows.append({"inside": bool(offset > 0), "verdict": verdict.value, "stated": stated, "naive": naive})
    return rows


def tally(results, factor: float = 1.0) -> dict:
    """Realised risks with one-sided 95 % bounds over units, inconclusive share, and the naive decision beside it."""
    by_unit = [decisions(r, factor) for r in results]
    rows = [row for unit in by_unit for row in unit]
    accepted, rejected = ([r for r in rows if r["verdict"] == v] for v in ("accepted", "rejected"))
    told = [r for r in rows if r["naive"] is not None]
    passed, failed = [r for r in told if r["naive"]], [r for r in told if not r["naive"]]
    return {
        "units": len(results),
        "converged": sum(r["converged"] for r in results),
        "decisions": len(rows),
        "nominal": {"consumer": CONSUMER, "producer": PRODUCER},
        "consumer_risk": _realised(by_unit, "accepted", lambda r: not r["inside"]),
        "consumer_risk_near": _realised(by_unit, "accepted", lambda r: not r["inside"], CONSUMER / 2),
        "producer_risk": _realised(by_unit, "rejected", lambda r: r["inside"]),
        "producer_risk_near": _realised(by_unit, "rejected", lambda r: r["inside"], PRODUCER / 2),
        "accepted_share": len(accepted) / len(rows),
        "rejected_share": len(rejected) / len(rows),
        "inconclusive_share": 1 - (len(accepted) + len(rejected)) / len(rows),
        "naive_consumer_risk": sum(not r["inside"] for r in passed) / max(1, len(passed)),
        "naive_producer_risk": sum(r["inside"] for r in failed) / max(1, len(failed)),
    }


def _realised(by_unit, verdict, wrong, least=0.0) -> dict:
    """Share of wrong decisions of one kind with at least that stated risk; bounds count a unit as one observation."""
    chosen = [[r for r in unit if r["verdict"] == verdict and r["stated"] >= least] for unit in by_unit]
    decided = [[wrong(r) for r in unit] for unit in chosen if unit]
    total = sum(len(d) for d in decided)
    if not total:
        return {"share": None, "stated": None, "lower_95": 0.0, "upper_95": 1.0, "decisions": 0}
    stated = sum(r["stated"] for unit in chosen for r in unit) / total
    share = sum(sum(d) for d in decided) / total
    n = len(decided)
    # Decisions on one unit hang together: bounds are those of a binomial with as many trials as units.
    hits = share * n
    lower = float(beta.ppf(0.05, hits, n - hits + 1)) if hits > 0 else 0.0
    upper = float(beta.ppf(0.95, hits + 1, n - hits)) if hits < n else 1.0
    return {"share": share, "stated": stated, "lower_95": lower, "upper_95": upper, "decisions": total}


def readme(summary, units) -> str:
    """The report: realised risks beside the agreed and the stated ones, and the decision by the point estimate."""
    lines = [
        f"# Risks of accepting and rejecting\n\nMade by `python studies/acceptance_risk.py --units {units}`.\n",
        f"Agreed risks: consumer's {CONSUMER:g}, producer's {PRODUCER:g}.",
        f"Limits stand up to {OFFSETS[-1]:g} posterior standard deviations from the truth, as often within as out of it.",
        "Realised: the share of the units accepted that are out of limits, of the units rejected that are within. Near:",
        "decisions whose stated risk is more than half the agreed one. Interval: 90 %, a unit counted once. With intervals of",
        "half the width the consumer's risk near a limit must be seen to rise: the last line.\n",
    ]
    for label, found in summary.items():
        lines += [f"## {label.capitalize()}\n", f"{found['converged']} of {found['units']} units converged.\n"]
        lines += ["| risk | agreed | stated | realised | interval | decisions |", "|---|--:|--:|--:|---|--:|"]
        for name, row in _risk_rows(found):
            agreed = CONSUMER if "consumer" in name else PRODUCER
            told = ["–", "–"] if row["share"] is None else [f"{row['stated']:.3f}", f"{row['share']:.3f}"]
            bounds = f"{row['lower_95']:.3f} – {row['upper_95']:.3f}"
            lines.append(f"| {name} | {agreed:g} | {told[0]} | {told[1]} | {bounds} | {row['decisions']} |")
        decided = (f"{found[key]:.2f} {what}" for key, what in _SHARES)
        naive = found["naive_consumer_risk"], found["naive_producer_risk"]
        lines += [f"\nShares of all decisions: {', '.join(decided)}. The point estimate compared with the limit"]
        lines += [f"realises a consumer's risk of {naive[0]:.2f} and a producer's of {naive[1]:.2f}.\n"]
    return "\n".join(lines)


_SHARES = (("accepted_share", "accepted"), ("rejected_share", "rejected"), ("inconclusive_share", "inconclusive"))


def _risk_rows(found):
    """Name and numbers of each risk of one label."""
    for risk in ("consumer", "producer"):
        yield f"{risk}'s", found[f"{risk}_risk"]
        yield f"{risk}'s, near", found[f"{risk}_risk_near"]
    yield "consumer's, near, intervals halved", found["near_with_halved_intervals"]


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--effects", choices=("both", "none", "creep"), default="both")
    parser.add_argument("--out", type=Path, default=Path("reports/acceptance-risk"))
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.units)
    summary = {}
    with ProcessPoolExecutor(given.workers) as pool:
        for label, delayed in (("within the model", False), ("with unmodelled creep", True)):
            if given.effects != "both" and delayed != (given.effects == "creep"):
                continue
            results = []
            for result in pool.map(one_unit, [(s, delayed) for s in seeds]):
                results.append(result)
                print(f"{label}: unit {result['seed']}, converged {result['converged']}, {result['seconds']:.0f} s", flush=True)
            summary[label] = tally(results) | {"near_with_halved_intervals": tally(results, 0.5)["consumer_risk_near"]}
            print(label, json.dumps(summary[label], indent=1), flush=True)
            given.out.mkdir(parents=True, exist_ok=True)
            (given.out / "acceptance_risk.json").write_text(json.dumps(summary, indent=1))
            (given.out / "README.md").write_text(readme(summary, given.units), encoding="utf-8")


if __name__ == "__main__":
    main()
