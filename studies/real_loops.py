"""Fit the eleven measured cycloidal units: convergence, preload trends, and small loops predicted from the large ones.

    python studies/real_loops.py --data ../shared/data/cycloidal --out reports/real-loops

Data: github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0; read from where they are, not copied.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.engine.parameters import posterior_parameters
from backdrive_bayes.engine.prediction import nodes, predict_angles
from backdrive_bayes.records.history import noise_free_torque
from backdrive_bayes.records.unit_folder import read_unit

K = 0.03
PARAMETERS = ("clearance_rad", "friction_torque_Nm", "load_friction_ratio")
CREDIT = "github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0"


def study_unit(job) -> dict:
    """Fit all loops, then the large ones alone, and predict the small ones from those."""
    warnings.simplefilter("ignore")
    began, unit = time.perf_counter(), read_unit(job)
    posterior, indicators = fit_unit(unit, FitOptions(k=K, seed=1))
    result = {"unit": unit.name, "all": indicators["convergence"], "seconds": round(time.perf_counter() - began, 1)}
    parameters = posterior_parameters(posterior)
    result["indicators"] = [{"file": r["file"], **r["indicators"]} for r in indicators["records"]]
    result["draws"] = {name: parameters[name].tolist() for name in PARAMETERS}
    large = replace(unit, records=tuple(r for r in unit.records if r.name.startswith("large")))
    alone, about = fit_unit(large, FitOptions(k=K, seed=2))
    result["large_only"] = about["convergence"]
    result["small_predicted"] = _predict_small(unit, alone)
    return result


def _predict_small(unit, posterior):
    if not posterior.converged:
        return None
    hits, total, width, gap = 0, 0, [], []
    for record in (r for r in unit.records if r.name.startswith("small")):
        pick = slice(None, None, 4)
        torque, _ = noise_free_torque(record.time_s[pick], record.torque_nm[pick])
        curves = predict_angles(posterior, record.time_s[pick], torque)
        lo, hi = np.quantile(curves, [0.05, 0.95], axis=0)
        measured = record.angle_rad[pick][nodes(torque)]
        hits += int(np.sum((measured >= lo) & (measured <= hi)))
        total += measured.size
        width.append(float(np.mean(hi - lo)))
        gap.append(float(np.sqrt(np.mean((np.median(curves, axis=0) - measured) ** 2))))
    return {"coverage_of_90": hits / total, "mean_width_rad": float(np.mean(width)), "rms_rad": float(np.mean(gap))}


def trends(results) -> list[dict]:
    """Probability that a parameter rises or falls from each preload to the next, from independent posteriors."""
    by_name, rows = {r["unit"]: r for r in results}, []
    for kind, preloads in (("conic", (1, 2, 4)), ("split", (0, 1, 2))):
        family = [f"{kind}-preload-{p}" for p in preloads]
        for low, high in (family[:2], family[1:], family[::2]):
            if not all(name in by_name and by_name[name]["all"]["converged"] for name in (low, high)):
                rows.append({"from": low, "to": high, "inconclusive": "one of the two has not converged"})
                continue
            row = {"from": low, "to": high}
            for name, sign in zip(PARAMETERS, (-1, 1, 1), strict=True):
                a, b = (np.array(by_name[u]["draws"][name]) for u in (low, high))
                n = min(a.size, b.size)
                row[f"P({name} {'rises' if sign > 0 else 'falls'})"] = float(np.mean(sign * (b[:n] - a[:n]) > 0))
                row[f"median {name}"] = [float(np.median(a)), float(np.median(b))]
            for name, sign in (("zero_torque_width_rad", -1), ("loop_area_J", 1)):
                row[f"P({name} {'rises' if sign > 0 else 'falls'}), loops"] = _loop_trend(by_name[low], by_name[high], name, sign)
            rows.append(row)
    return rows


def _loop_trend(low, high, name, sign):
    """Share of pairs of large loops of the two units that order as claimed: replicates, no model."""
    values = [[r[name]["median"] for r in u["indicators"] if r["file"].startswith("large")] for u in (low, high)]
    return float(np.mean([sign * (b - a) > 0 for a in values[0] for b in values[1]]))


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data/cycloidal"))
    parser.add_argument("--out", type=Path, default=Path("reports/real-loops"))
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    folders = sorted(p.parent for p in options.data.glob("*/unit.toml"))
    results = []
    with ProcessPoolExecutor(options.workers) as pool:
        for result in pool.map(study_unit, folders):
            results.append(result)
            state = {k: result["all"][k] for k in ("converged", "max_rhat", "min_tail_ess", "contradictions")}
            print(result["unit"], state, result["seconds"], "s, large only", result["large_only"]["converged"], flush=True)
            print("  small predicted", result["small_predicted"], flush=True)
            # Kept unit by unit: the whole takes long.
            kept = [{k: v for k, v in r.items() if k != "draws"} for r in results]
            (options.out / "real_loops.json").write_text(json.dumps({"credit": CREDIT, "units": kept, "trends": []}, indent=1))
    rows = trends(results)
    for row in rows:
        print(row)
    (options.out / "real_loops.json").write_text(json.dumps({"credit": CREDIT, "units": kept, "trends": rows}, indent=1))


if __name__ == "__main__":
    main()
