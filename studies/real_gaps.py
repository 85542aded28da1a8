"""Diagnose the eleven measured cycloidal units with a module withheld from the baseline, and with the whole baseline.

    python studies/real_gaps.py --data ../shared/data/cycloidal --workers 2 --out reports/real-gaps

Geometric error is withheld, then friction: the answer should hold it. With the whole baseline nobody knows the answer; beside it
stands how much of what it leaves comes again in replicate loops. Written: real_gaps.json, one entry a unit and baseline as it is
found (those there of the same code are left alone, others made anew), how often what was withheld was named, and the replicates.

Data: github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0; read from where they are, not copied.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import itertools
import json
import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from code_hash import code_hash

from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.model.registry import BASELINE
from backdrive_bayes.records.unit_folder import read_unit

CREDIT = "github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0"
CODE = code_hash(("gap", "inference", "model", "records"))
WITHHELD = ("geometric", "friction", None)


def study(job) -> dict:
    """What diagnosis.json says of one unit with one module withheld (None: the whole baseline), in brief."""
    warnings.simplefilter("ignore")
    folder, withheld = job
    unit = read_unit(folder)
    found = diagnose(unit, baseline=tuple(name for name in BASELINE if name != withheld)).json
    shrink = found["shrink"]
    return {
        "unit": unit.name, "withheld": withheld, "inconclusive": found["inconclusive"], "answer": found["answer"]["effects"],
        "set_90": found["answer"]["credible_set_90"],
        "probabilities": {row["effect"]: round(row["probability"], 4) for row in found["which"][:5]},
        "probability_of_withheld": sum(r["probability"] for r in found["which"] if withheld in r["effect"].split("+")),
        "where": found["where"]["summary"], "closed_fraction": shrink["closed_fraction"],
        "unlisted_probability": found["gap"]["unlisted_probability"], "code": CODE,
        "control": shrink["gaussian_process"]["closed_fraction"],
        **{key: shrink[key] for key in ("before_rad", "after_rad", "noise_floor_rad")}, "seconds": round(found["seconds"], 1),
    }  # fmt: skip


def replicates(folder) -> dict | None:
    """What the whole baseline leaves of the loops after the first of their size, and how much two of them differ in it [rad].

    Two residuals of the same leg are compared at the same torques, their offset taken out; half the mean square of the difference
    is what does not come again. None where no two loops are alike.
    """
    warnings.simplefilter("ignore")
    unit = read_unit(folder)
    setting = Setting.of(unit, np.random.default_rng(0), BASELINE)
    problem, alike = setting.problem, setting.places.same_loop
    curves = []
    for r, data in enumerate(problem.records):
        residual = data.blocks.angle_rad - problem.model.angle(problem.values(setting.z, r), data.path)
        legs = [data.blocks.leg == k for k in range(1, data.blocks.direction.size)]
        curves.append([(data.blocks.torque_nm[own], residual[own]) for own in legs])
    later = [r for r in range(len(curves)) if alike[r, :r].any()]
    squares, differences = [], []
    for i, j in itertools.permutations(later, 2):
        if not alike[i, j] or len(curves[i]) != len(curves[j]):
            continue
        for (torque, one), (other_torque, other) in zip(curves[i], curves[j], strict=True):
            order = np.argsort(other_torque)
            span = np.abs(np.gradient(torque))
            squares.append(_spread(one, span))
            differences.append(0.5 * _spread(one - np.interp(torque, other_torque[order], other[order]), span))
    if not squares:
        return None
    left, apart = np.mean(squares), np.mean(differences)
    return {
        "unit": unit.name, "left_rad": float(np.sqrt(left)), "not_repeated_rad": float(np.sqrt(apart)),
        "repeated_share": float(1 - apart / left), "median_noise_rad": setting.noise_rad, "code": CODE,
    }  # fmt: skip


def _spread(values, weights):
    return np.average((values - np.average(values, weights=weights)) ** 2, weights=weights)


def named(found, withheld) -> dict:
    """Of the units without a module, how many answers hold it, how many do not, how many gave no verdict."""
    asked = [r for r in found if r["withheld"] == withheld]
    told = [r for r in asked if not r["inconclusive"]]
    right = sum(withheld in r["answer"] for r in told)
    inside = sum(any(withheld in label.split("+") for label in r["set_90"]) for r in told)
    return {"withheld": withheld, "units": len(asked), "right": right, "wrong": len(told) - right, "in_the_set": inside,
            "inconclusive": len(asked) - len(told)}  # fmt: skip


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data/cycloidal"))
    parser.add_argument("--out", type=Path, default=Path("reports/real-gaps"))
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    folders = sorted(p.parent for p in options.data.glob("*/unit.toml"))
    path = options.out / "real_gaps.json"
    kept = json.loads(path.read_text()) if path.exists() else {}
    found, again = ([row for row in kept.get(part, []) if row["code"] == CODE] for part in ("diagnoses", "replicates"))
    done = {(row["unit"], row["withheld"]) for row in found}
    jobs = [(folder, withheld) for withheld in WITHHELD for folder in folders if (folder.name, withheld) not in done]

    def write():
        counts = [named(found, module) for module in WITHHELD[:-1]]
        path.write_text(json.dumps({"credit": CREDIT, "named": counts, "diagnoses": found, "replicates": again}, indent=1))
        return counts

    with ProcessPoolExecutor(options.workers) as pool:
        for result in pool.map(study, jobs):
            found.append(result)
            write()
            print(*(result[k] for k in ("unit", "withheld", "answer", "probabilities", "where", "seconds")), flush=True)
        known = {row["unit"] for row in again}
        again += [row for row in pool.map(replicates, [f for f in folders if f.name not in known]) if row]
    for line in (*write(), *again):
        print(line)


if __name__ == "__main__":
    main()
