"""Temperatures and priors of the diagnosis, set on units of the virtual bench.

    python studies/diagnosis_calibration.py weigh --units 160 --out reports/diagnosis-calibration
    python studies/diagnosis_calibration.py set --out reports/diagnosis-calibration

``weigh`` draws units as a blind check does and keeps the log evidences of every hypothesis (evidences.jsonl, one line a unit;
units that are there already are left alone). Every fifth unit is weighed once more with its true effect taken out of the library:
the right answer is then unknown. Each line bears a fingerprint of the code behind it; others are not mixed in. ``set`` finds
the calibration of highest mean log score over those units, and tells by ten-fold cross-validation what it is worth on units that
it has not seen (calibration.json).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import hashlib
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import backdrive_bayes
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.blind.calibration import calibration
from backdrive_bayes.blind.key import label_of
from backdrive_bayes.blind.request import Request, assign, draw_plan
from backdrive_bayes.gap.candidates import weigh_all
from backdrive_bayes.gap.fast import weigh_fast
from backdrive_bayes.gap.probabilities import CALIBRATION, Evidences, credible_set, marginal, probabilities
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.model.registry import BASELINE, candidates_beside

SEED = 77
SEVERITIES = (1.0, 0.4, 0.2, 0.1)
UNKNOWN = "unknown"
CANDIDATES = candidates_beside(BASELINE)
WEIGHED_LATER = ("probabilities.py", "diagnose.py", "next_test.py", "shrink.py", "where.py")
DIRT = (0.5, 3.0)
"""Level of the small faults that every bench has, from cleaner than usual to dirtier."""


def fingerprint() -> str:
    """Hash of the code that the evidences come from; what turns them into probabilities is not part of it."""
    package = Path(backdrive_bayes.__file__).parent
    files = sorted(p for part in ("bench", "gap", "inference", "model") for p in (package / part).rglob("*.py"))
    return hashlib.sha256(b"".join(p.read_bytes() for p in files if p.name not in WEIGHED_LATER)).hexdigest()[:12]


def weigh(job) -> dict:
    """Evidences of one unit, with its truth; without its first effect in the library if so asked."""
    warnings.simplefilter("ignore")
    index, effects, removed = job
    rng = np.random.default_rng([SEED, index])
    bench = draw_unit(rng, effects, plan=draw_plan(Request(1), rng), dirt=float(rng.uniform(*DIRT)))
    began, rng = time.perf_counter(), np.random.default_rng(0)
    setting = Setting.of(bench.unit, rng, BASELINE)
    truth = label_of(bench.truth.answer)
    allowed = [name for name in CANDIDATES if name != truth] if removed else None
    candidates = weigh_all(setting, rng, allowed=allowed)
    fast = weigh_fast(setting, candidates.best.fitted).within(allowed)
    planted = [
        {"name": p.name, "severity": p.severity, "height": round(p.height, 2), "limited": bool(p.limited)}
        for p in bench.truth.planted
    ]
    return {
        "index": index, "removed": removed, "truth": UNKNOWN if removed else truth,
        "severity": min(effects.values(), default=None), "planted": planted, "code": fingerprint(),
        "evidences": Evidences.of(candidates, fast).as_json(), "seconds": time.perf_counter() - began,
    }  # fmt: skip


def told(result, chosen=CALIBRATION) -> dict[str, float]:
    """Probabilities by label under a calibration."""
    labels = marginal(probabilities(Evidences.from_json(result["evidences"]), chosen))
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
        jobs += [(i, chosen, removed) for removed in (False, True) if not removed or (listed and i % 5 == 0)]
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


def with_values(values):
    """A calibration from free values: temperatures above one, prior weights that sum to one."""
    warm, cool, halfway, ft, fast, slope, rising, remainder, imprint, slack, exact, loose, *prior = values
    none, single, pair, unknown = np.exp(prior) / np.exp(prior).sum()
    misfit = np.exp(-np.exp(slope) * np.arange(len(CALIBRATION.misfit)))
    level = np.exp(rising * np.arange(len(CALIBRATION.unknown_level)))
    formula = np.exp([exact, 0.0, loose])
    return replace(
        CALIBRATION, warm=1 + np.exp(warm), cool=1 + np.exp(cool), halfway=np.exp(halfway),
        fast_temperature=1 + np.exp(ft), none=none, single=single, pair=pair, unknown=unknown,
        imprint=1 + np.exp(imprint), fast=1 / (1 + np.exp(-fast)), misfit=tuple(misfit / misfit.sum()),
        unknown_level=tuple(level / level.sum()), formula=tuple(formula / formula.sum()),
        remainder=np.exp(remainder), slack=np.exp(slack),
    )  # fmt: skip


START = np.concatenate([
    np.log([5.0, 1.0, 40.0, 6.0]), [-2.2, -0.4, 0.0], np.log([0.3, 2.5, 0.05, 1.0, 0.5, 0.4, 0.44, 0.01, 0.15]),
])  # fmt: skip


def find(results) -> np.ndarray:
    """Free values of the highest mean log score, held near the start by a weak prior."""

    def loss(values):
        chosen = with_values(values)
        given = [told(r, chosen).get(r["truth"], 0.0) for r in results]
        return -np.mean(np.log(np.maximum(given, 1e-4))) + 0.5 * np.sum((values - START) ** 2) / len(results)

    return minimize(loss, START, method="Powell", options={"maxfev": 1500, "xtol": 0.02, "ftol": 1e-4}).x


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
    fold = np.random.default_rng(0).permutation(len(results)) % 10
    unseen = [None] * len(results)
    for k in range(10):
        chosen = with_values(find([r for r, f in zip(results, fold, strict=True) if f != k]))
        for i in np.flatnonzero(fold == k):
            unseen[i] = told(results[i], chosen)
    best = with_values(find(results))
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
