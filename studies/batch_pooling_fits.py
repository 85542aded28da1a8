"""A batch of a dozen real fits pooled: do the pooled intervals hold what the virtual reducers truly do?

    python studies/batch_pooling_fits.py --units 12 --keep /tmp/batch

Reducers of one batch: clearance, compliance and friction differ from unit to unit by a known relative spread. Each is measured
once, fitted as the command `fit` does, kept and pooled as `fleet --pool batch` does. Every third unit comes from a bench with ten
times the usual slow noise, so that it tells little by itself, the others from one with three times of it. The result is
reports/batch-pooling/fits.json.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from pathlib import Path

import numpy as np
from batch_pooling import HOME, LEVEL

from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, physical_reducer, ramp, simulate_unit
from backdrive_bayes.commands.results import FitOptions, fit_unit, keep_fit
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.indicators.draws import CORE, core_indicators
from backdrive_bayes.indicators.loop import Loops, torque_grid
from backdrive_bayes.pooling.pool import pool_batch
from backdrive_bayes.pooling.unit import unit_draws

SPREADS = {"clearance": 0.08, "compliance": 0.03, "friction": 0.10}
USUAL = {"clearance": 0.9, "compliance": 0.5, "friction": 0.3}
RATED, RATE, K = 0.1, 0.05, 0.03
NOISE = tuple(BenchNoise(correlated_rad=times * BenchNoise.correlated_rad, correlation_time_s=0.1) for times in (3, 3, 10))


def draw_reducer(rng) -> KnownReducer:
    """A reducer of the batch."""
    return physical_reducer(rng, scatter=0.0, **{n: v * np.exp(SPREADS[n] * rng.standard_normal()) for n, v in USUAL.items()})


def true_indicators(known: KnownReducer) -> dict[str, float]:
    """Indicators of the settled loop without noise."""
    time_s, torque = ramp(RATED, RATE, legs=(1, -1, 1, -1, 1))
    angle, n = known.angle_rad(time_s, torque), int(round(2 * RATED / RATE * 1000))
    grid = torque_grid(RATED, (K * RATED, *known.reducer.knots * RATED))
    falling = np.interp(grid, torque[-2 * n - 1 : -n][::-1], angle[-2 * n - 1 : -n][::-1])
    rising = np.interp(grid, torque[-n - 1 :], angle[-n - 1 :])
    return {k: float(v[0]) for k, v in core_indicators(Loops(grid, rising[None], falling[None]), K * RATED).items()}


def fitted(number: int, keep: Path) -> Path:
    """The result folder of one unit, made where it is not there yet, with its truth beside it."""
    folder = keep / f"unit-{number:02d}"
    if not (folder / "truth.json").is_file():
        rng = np.random.default_rng([20261122, number])
        known = draw_reducer(rng)
        unit = simulate_unit(known, [(RATED, RATE)], NOISE[number % len(NOISE)], rng)
        posterior, about = fit_unit(unit, FitOptions(k=K, seed=number))
        folder.mkdir(parents=True, exist_ok=True)
        keep_fit(posterior, about, folder, figures=False)
        (folder / "truth.json").write_text(json.dumps(true_indicators(known)), encoding="utf-8")
    return folder


def population(count: int = 400) -> dict:
    """Geometric mean, spread of the logarithm, mean and spread of each indicator over many reducers of the batch."""
    rng = np.random.default_rng(7)
    rows = [true_indicators(draw_reducer(rng)) for _ in range(count)]
    values = {name: np.array([row[name] for row in rows]) for name in CORE}
    logs = {name: np.log(v) for name, v in values.items()}
    return {
        name: {"log": (float(np.exp(logs[name].mean())), float(logs[name].std(ddof=1))),
               "linear": (float(v.mean()), float(v.std(ddof=1)))}
        for name, v in values.items()
    }  # fmt: skip


def tally(pool: dict, truths: dict, everyone: dict) -> dict:
    """Each indicator's pooled numbers beside the truth."""
    rows = {}
    for found in (q for q in pool["quantities"] if q["name"] in CORE):
        mean, spread = everyone[found["name"]][found["scale"]]
        row = {key: found[key] for key in ("refused", "scale", "units")} | {"true_mean": mean, "true_spread": spread}
        if not found["refused"]:
            units = [(r, truths[r["unit"]][found["name"]]) for r in found["of_units"] if r["pooled"]]
            ratio = [np.log(r["pooled"]["hi"] / r["pooled"]["lo"]) / np.log(r["own"]["hi"] / r["own"]["lo"]) for r, _ in units]
            row |= {key: found[key] for key in ("mean", "spread", "next_unit", "loss_bits")}
            row |= {
                "mean_held": bool(found["mean"]["lo"] <= mean <= found["mean"]["hi"]),
                "spread_held": bool(found["spread"]["lo"] <= spread <= found["spread"]["hi"]),
                "own_held": sum(r["own"]["lo"] <= x <= r["own"]["hi"] for r, x in units),
                "pooled_held": sum(r["pooled"]["lo"] <= x <= r["pooled"]["hi"] for r, x in units),
                "pooled": len(units), "narrower": float(np.median(ratio)), "narrowest": float(np.min(ratio)),
                "largest_prior_shift_sd": float(max(abs(r["prior_shift_sd"]) for r in found["of_units"])),
            }  # fmt: skip
        rows[found["name"]] = row
    return rows


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--units", type=int, default=12)
    parser.add_argument("--keep", type=Path, required=True, help="folder of the fits, made where they are not there")
    parser.add_argument("--out", type=Path, default=HOME)
    given = parser.parse_args()
    began = time.perf_counter()
    folders = [fitted(i, given.keep) for i in range(given.units)]
    fitting, began = time.perf_counter() - began, time.perf_counter()
    units = [unit_draws(Evidence.read(folder), folder.name) for folder in folders]
    reading, began = time.perf_counter() - began, time.perf_counter()
    pool = pool_batch("simulated", units, 0, LEVEL)
    pooling = time.perf_counter() - began
    truths = {folder.name: json.loads((folder / "truth.json").read_text(encoding="utf-8")) for folder in folders}
    rows = tally(pool, truths, population())
    seconds = {"fits_s": fitting, "reading_s_a_unit": reading / len(folders), "pooling_s": pooling}
    found = {"units": len(pool["units"]), "left_out": pool["left_out"], **seconds, "indicators": rows}
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "fits.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
