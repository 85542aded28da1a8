"""Temperatures and priors of the diagnosis, set on units of the virtual bench.

    python studies/diagnosis_calibration.py weigh --units 160 --out reports/diagnosis-calibration
    python studies/diagnosis_calibration.py set --out reports/diagnosis-calibration

``weigh`` draws units as a blind check does and keeps the log evidences of every hypothesis (evidences.jsonl, one line a unit;
units that are there already are left alone). Every fifth unit is weighed once more with its true effect taken out of the library:
the right answer is then unknown. Each line bears a fingerprint of the code behind it; others are not mixed in. ``set`` finds
the calibration of highest mean log score over those units, and tells by five-fold cross-validation what it is worth on units that
it has not seen (calibration.json).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from code_hash import code_hash

from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.blind.calibration import calibration
from backdrive_bayes.blind.key import label_of
from backdrive_bayes.blind.request import Request, assign, draw_plan
from backdrive_bayes.gap.candidates import MISFIT_LEVELS, UNKNOWN_LEVELS, weigh_all
from backdrive_bayes.gap.fast import weigh_fast
from backdrive_bayes.gap.probabilities import CALIBRATION, Evidences, credible_set, marginal, probabilities
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.model.registry import BASELINE, candidates_beside

SEED = 77
SEVERITIES = (1.0, 0.4, 0.2, 0.1)
UNKNOWN = "unknown"
CANDIDATES = candidates_beside(BASELINE)
WEIGHED_LATER = ("probabilities.py", "diagnose.py", "draws.py", "next_test.py", "shrink.py", "where.py")
DIRT = (0.5, 3.0)
"""Level of the small faults that every bench has, from cleaner than usual to dirtier."""


def fingerprint() -> str:
    """Hash of the code that the evidences come from; what turns them into probabilities is not part of it."""
    return code_hash(("bench", "blind", "gap", "inference", "model", "records"), WEIGHED_LATER)


def weigh(job) -> dict:
    """Evidences of one unit, with its truth; without its first effect in the library if so asked."""
    warnings.simplefilter("ignore")
    index, effects, removed, code = job
    rng = np.random.default_rng([SEED, index])
    bench = draw_unit(rng, effects, plan=draw_plan(Request(1), rng), soil=float(rng.uniform(*DIRT)))
    began, rng = time.perf_counter(), np.random.default_rng(0)
    setting = Setting.of(bench.unit, rng, BASELINE)
    truth = label_of(bench.truth.answer)
    allowed = [name for name in CANDIDATES if name != truth] if removed else None
    candidates = weigh_all(setting, rng, allowed=allowed)
    fast, candidates = weigh_fast(setting, candidates)
    planted = [
        {"name": p.name, "severity": p.severity, "height": round(p.height, 2), "limited": bool(p.limited)}
        for p in bench.truth.planted
    ]
    return {
        "index": index, "removed": removed, "truth": UNKNOWN if removed else truth,
        "severity": min(effects.values(), default=None), "planted": planted, "code": code,
        "evidences": Evidences.of(candidates, fast.within(allowed)).as_json(), "seconds": time.perf_counter() - began,
    }  # fmt: skip


def told(result, chosen=CALIBRATION) -> dict[str, float]:
    """Probabilities by label under a calibration."""
    if not isinstance(result["evidences"], Evidences):
        result["evidences"] = Evidences.from_json(result["evidences"])
    labels = marginal(probabilities(result["evidences"], chosen))
    return {label_of(name.split("+")) if name != "none" else name: p for name, p in labels.items()}


def run(options):
    """Weigh the units that are not there yet."""
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "evidences.jsonl"
    done = {(r["index"], r["removed"]) for r in read(path)} if path.exists() else set()
    effects = assign(Request(options.units, SEVERITIES, seed=SEED), np.random.default_rng([SEED, 0]))
    jobs = []
    for i, chosen in enumerate(effects):
        listed = len(chosen) == 1 and next(iter(chosen)) in CANDIDATES
        jobs += [(i, chosen, removed, fingerprint()) for removed in (False, True) if not removed or (listed and i % 5 == 0)]
    with ProcessPoolExecutor(options.workers) as pool, path.open("a") as file:
        for result in pool.map(weigh, [job for job in jobs if (job[0], job[2]) not in done]):
            file.write(json.dumps(result) + "\n")
            file.flush()
            show(result)


def read(path) -> list[dict]:
    """Evidences kept so far, all of the present code. Raises ValueError where some are not."""
    results = [json.loads(line) for line in path.read_text().splitlines()]
    if any(r.get("code") != fingerprint() for r in results):
        raise ValueError(f"{path}: evidences of other code; give another --out")
    return results


def show(result):
    """One line a unit."""
    labels = told(result)
    top = list(labels.items())[:3]
    names = [f"{p['name']} {p['severity']} ({p['height']:.1f})" for p in result["planted"]]
    verdict = "ok " if top[0][0] == result["truth"] else "BAD"
    said = [f"{k} {v:.2f}" for k, v in top]
    index = f"{result['index']}{' removed' * result['removed']}"
    print(index, verdict, result["truth"], names, said, f"{result['seconds']:.0f} s", flush=True)


def falling(rate, count):
    """Weights that fall by exp(-rate) from each to the next and sum to one."""
    weights = np.exp(-rate * np.arange(count))
    return tuple((weights / weights.sum()).tolist())


GRID = {
    "cool": (1.5, 2.0, 2.5, 3.5, 5.0), "warm": (4.0, 6.0, 9.0, 13.0), "halfway": (10.0, 20.0, 40.0, 80.0),
    "remainder": (0.1, 0.3, 1.0), "slack": (0.0, 0.02, 0.05, 0.1), "unknown": (0.05, 0.1, 0.2, 0.3),
    "formula": ((0.4, 0.4, 0.2), (0.6, 0.38, 0.02), (0.75, 0.22, 0.03), (0.9, 0.09, 0.01)),
    "misfit": tuple(falling(r, len(MISFIT_LEVELS)) for r in (0.3, 0.7, 1.5)),
    "unknown_level": tuple(falling(r, len(UNKNOWN_LEVELS)) for r in (-1.0, 0.0, 1.0)),
    "pair": (0.002, 0.005, 0.01, 0.02, 0.03), "none": (0.3, 0.4, 0.5, 0.6), "fast_temperature": (5.0, 8.0, 12.0),
    "fast": (0.05, 0.1, 0.2), "imprint": (2.0, 3.4), "beside": (0.1, 0.3, 1.0),
}  # fmt: skip
"""Values that are tried, one entry of the calibration after another."""


def find(results, passes: int = 2):
    """The calibration of the highest mean log score by going through the grid entry by entry, from the present one."""

    def loss(chosen):
        return -np.mean([np.log(max(told(r, chosen).get(r["truth"], 0.0), 1e-3)) for r in results])

    best, least = CALIBRATION, loss(CALIBRATION)
    for _ in range(passes):
        for name, values in GRID.items():
            tried = [replace(best, **{name: value}) for value in values]
            losses = [loss(chosen) for chosen in tried]
            if min(losses) < least - 1e-4:
                best, least = tried[int(np.argmin(losses))], min(losses)
    return best


def kinds_of(pairs) -> dict:
    """Results and forecasts by what was asked: listed effects, pairs, unlisted ones, those taken out of the library, none."""
    kinds = {}
    for result, forecast in pairs:
        unlisted = "unlisted" if result["truth"] == UNKNOWN else "pair" if "+" in result["truth"] else "listed"
        kinds.setdefault("removed" if result["removed"] else "none" if result["truth"] == "none" else unlisted, []).append(
            (result, forecast)
        )
    return kinds


def score(results, forecasts) -> dict:
    """Hit rates by severity, set coverage and size, false alarms, calibration."""
    table = {}
    for severity in (None, *SEVERITIES):
        own = [(r, f) for r, f in zip(results, forecasts, strict=True) if r["severity"] == severity]
        for kind, mine in kinds_of(own).items():
            table[f"{'none' if severity is None else f'{severity:g}'} {kind}"] = {
                "units": len(mine), "right": sum(max(f, key=f.get) == r["truth"] for r, f in mine),
            }  # fmt: skip
    sets = [credible_set(f) for f in forecasts]
    truths = [r["truth"] for r in results]
    found = calibration(forecasts, truths)
    top = found["top"]
    return {
        "right": table, "set_coverage": float(np.mean([t in s for t, s in zip(truths, sets, strict=True)])),
        "set_size": float(np.mean([len(s) for s in sets])), "calibration_error": top["expected_error"],
        "mean_probability": top["mean_probability"], "hit_rate": top["hit_rate"], "log_score": found["log_score"]["mean"],
    }  # fmt: skip


def settle(options):
    """Find the calibration and write what it is worth."""
    results = read(options.out / "evidences.jsonl")
    units = sorted({r["index"] for r in results})
    fold_of = dict(zip(units, np.random.default_rng(0).permutation(len(units)) % 5, strict=True))
    fold = np.array([fold_of[r["index"]] for r in results])
    unseen = [None] * len(results)
    for k in range(5):
        chosen = find([r for r, f in zip(results, fold, strict=True) if f != k])
        for i in np.flatnonzero(fold == k):
            unseen[i] = told(results[i], chosen)
    best = find(results)
    summary = {
        "units": len(results), "calibration": asdict(best), "cross_validated": score(results, unseen),
        "as_set_now": score(results, [told(r) for r in results]), "seen": score(results, [told(r, best) for r in results]),
    }  # fmt: skip
    (options.out / "calibration.json").write_text(json.dumps(summary, indent=1, default=float))
    print(json.dumps(summary, indent=1, default=float))


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("step", choices=("weigh", "set"))
    parser.add_argument("--units", type=int, default=160)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("reports/diagnosis-calibration"))
    options = parser.parse_args()
    {"weigh": run, "set": settle}[options.step](options)


if __name__ == "__main__":
    main()
