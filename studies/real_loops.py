"""The eleven measured cycloidal units: convergence, preload trends, small loops predicted from the large ones, modules withheld.

    python studies/real_loops.py --data ../shared/data/cycloidal --out reports/real-loops --seconds 1200

Data: github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0; read from where they are, not copied.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from real_loops_page import broken_assumptions, write_page

from backdrive_bayes.commands.results import FitOptions, diagnose_unit, fit_unit
from backdrive_bayes.engine.parameters import posterior_parameters
from backdrive_bayes.engine.prediction import nodes, predict_angles
from backdrive_bayes.records.history import noise_free_torque
from backdrive_bayes.records.unit_folder import read_unit

K = 0.03
PARAMETERS = ("clearance_rad", "friction_torque_Nm", "load_friction_ratio")


def study_unit(folder: Path) -> dict:
    """Fit all loops, then the large ones alone, and predict the small ones from those."""
    warnings.simplefilter("ignore")
    began, unit = time.perf_counter(), read_unit(folder)
    posterior, indicators = fit_unit(unit, FitOptions(k=K, seed=1))
    result = {"unit": unit.name, "all": indicators["convergence"], "seconds": round(time.perf_counter() - began, 1)}
    parameters = posterior_parameters(posterior)
    result["indicators"] = [{"file": r["file"], **r["indicators"]} for r in indicators["records"]]
    result["draws"] = {name: parameters[name].tolist() for name in PARAMETERS}
    result["left_rad"] = _left(posterior)
    large = replace(unit, records=tuple(r for r in unit.records if r.name.startswith("large")), file_sha256="")
    alone, about = fit_unit(large, FitOptions(k=K, seed=2))
    result["large_only"] = about["convergence"]
    result["small_predicted"], result["curves"] = _predict_small(unit, alone)
    return result | {"broken": broken_assumptions(unit)}


def _left(posterior) -> float:
    """Rms of what the fit of all loops leaves of the small ones' settled blocks [rad]."""
    square = []
    for blocks, predicted in zip(posterior.records.blocks, posterior.predicted_rad, strict=True):
        if blocks.name.startswith("small"):
            left = (blocks.angle_rad - predicted)[blocks.leg > 0]
            square.append((left - left.mean()) ** 2)
    return float(np.sqrt(np.mean(np.concatenate(square))))


def _predict_small(unit, posterior):
    """Scores of the small loops' prediction, and the first loop with it for the figure; offsets are taken out of every curve."""
    rows, curves = [], {}
    for record in (r for r in unit.records if r.name.startswith("small")):
        pick = slice(None, None, 4)
        torque, _ = noise_free_torque(record.time_s[pick], record.torque_nm[pick])
        found, measured = predict_angles(posterior, record.time_s[pick], torque), record.angle_rad[pick]
        found = found - np.median(found - measured[nodes(torque)], axis=1, keepdims=True)
        measured = measured[nodes(torque)]
        lo, middle, hi = np.quantile(found, [0.05, 0.5, 0.95], axis=0)
        rows.append((np.mean((measured >= lo) & (measured <= hi)), np.mean(hi - lo), np.sqrt(np.mean((middle - measured) ** 2))))
        if not curves:
            kept = {"torque_nm": torque[nodes(torque)], "measured": measured, "lo": lo, "middle": middle, "hi": hi}
            curves = {name: values.tolist() for name, values in kept.items()}
    coverage, width, rms = np.mean(rows, axis=0)
    return {"coverage_of_90": float(coverage), "mean_width_rad": float(width), "rms_rad": float(rms)}, curves


def withheld(folder: Path, module: str) -> dict:
    """Whether a diagnosis without one module of the baseline names it."""
    warnings.simplefilter("ignore")
    unit = read_unit(folder)
    baseline = tuple(m for m in FitOptions.baseline if m != module)
    result, _ = diagnose_unit(unit, FitOptions(baseline, k=K, seed=1), sample=False)
    answer = result["answer"]
    likeliest = {row["effect"]: row["probability"] for row in result["which"][:3]}
    return {"unit": unit.name, "module": module, "effects": answer["effects"], "likeliest": likeliest,
            "credible_set_90": answer["credible_set_90"]}


def trends(results) -> list[dict]:
    """Probability that a parameter rises or falls from each preload to the next, from independent posteriors."""
    by_name, rows = {r["unit"]: r for r in results}, []
    for kind, preloads in (("conic", (1, 2, 4)), ("split", (0, 1, 2))):
        family = [f"{kind}-preload-{p}" for p in preloads]
        for low, high in (family[:2], family[1:], family[::2]):
            if not all(name in by_name and by_name[name]["all"]["converged"] for name in (low, high)):
                rows.append({"from": low, "to": high, "inconclusive": "one of the two has not converged"})
                continue
            row: dict = {"from": low, "to": high}
            for name, sign in zip(PARAMETERS, (-1, 1, 1), strict=True):
                a, b = (np.array(by_name[u]["draws"][name]) for u in (low, high))
                # All pairs: fits of one seed share their random numbers draw by draw.
                row[f"P({name} {'rises' if sign > 0 else 'falls'})"] = float(np.mean(sign * (b[:, None] - a) > 0))
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
    parser.add_argument("--seconds", type=float, default=1e9, help="nothing is begun after so many seconds")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    folders = sorted(p.parent for p in options.data.glob("*/unit.toml"))
    jobs = [(study_unit, folder) for folder in folders]
    jobs += [(withheld, folder, module) for module in ("geometric", "friction") for folder in folders]
    began, fits, named = time.perf_counter(), [], []
    for study, *given in jobs:
        if time.perf_counter() - began > options.seconds:
            break
        (fits if study is study_unit else named).append(study(*given))
        last = (fits if study is study_unit else named)[-1]
        print({k: v for k, v in last.items() if k not in ("indicators", "draws", "curves")}, flush=True)
        write_page(options.out, fits, named, trends(fits), len(folders))


if __name__ == "__main__":
    main()
