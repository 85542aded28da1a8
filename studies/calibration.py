"""Coverage and simulation-based calibration on units near the physical family.

    python studies/calibration.py --units 120 --out reports/calibration

Every unit's parameters are drawn about the usual ones, its records simulated with correlated and white angle noise and torque
noise, and fitted with fresh seeds. Written: calibration.json (coverage of the 90 % intervals with binomial bounds, SBC ranks and
the p-value of their uniformity) and ranks.png.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import binom, chisquare

from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, random_reducer, simulate_unit
from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.engine.parameters import Operator, parameters_of
from backdrive_bayes.indicators.draws import CORE, IndicatorDraws, core_indicators
from backdrive_bayes.indicators.loop import cut_loops, torque_grid

RATED = 0.1
LOOPS = ((0.1, 0.05), (0.05, 0.05))
K = 0.03
RANKS = 99


def one_unit(seed: int, noise_factor: float = 1.0) -> dict:
    """Fit one simulated unit; ranks of the truth among thinned draws, whether 90 % intervals hold it, convergence."""
    rng = np.random.default_rng([20261121, seed])
    known = random_reducer(rng)
    unit = simulate_unit(known, LOOPS, BenchNoise(), rng)
    began = time.perf_counter()
    posterior, _ = fit_unit(unit, FitOptions(k=K, seed=seed))
    result = {"seed": seed, "converged": posterior.converged, "seconds": time.perf_counter() - began, "quantities": {}}
    truths, draws = true_parameters(known), IndicatorDraws(posterior, K)
    for name, values in draws.parameters.items():
        result["quantities"][name] = place(truths[name], values, noise_factor)
    for r, (amplitude, _) in enumerate(LOOPS):
        true = true_indicators(known, amplitude)
        for name in CORE:
            values = draws.values(name, draws.rates[r], draws.amplitudes[r])
            result["quantities"][f"{name}[{r}]"] = place(true[name], values, noise_factor)
    return result


def true_parameters(known: KnownReducer) -> dict:
    """The user's parameters of the known reducer."""
    weights = {name: w[None] for name, w in known.weights.items()}
    operator = Operator(known.reducer, weights, known.torque_scale_nm, known.angle_scale_rad, 1.0)
    return {name: float(v[0]) for name, v in parameters_of(operator).items()}


def true_indicators(known: KnownReducer, amplitude) -> dict:
    """Noise-free indicators of the settled loop."""
    torque = torque_grid(amplitude, (K * RATED, *known.reducer.knots * RATED))
    whole = amplitude * np.array([0.0, 1.0, -1.0, 1.0])
    whole = np.r_[whole, torque[::-1][1:], torque[1:]]
    loops = cut_loops(torque, known.angle_rad(np.arange(whole.size, dtype=float), whole)[None])
    return {k: float(v[0]) for k, v in core_indicators(loops, K * RATED).items()}


def place(truth, draws, noise_factor=1.0):
    """Rank of the truth among 99 thinned draws and whether the central 90 % interval holds it."""
    draws = np.median(draws) + noise_factor * (draws - np.median(draws))
    lo, hi = np.quantile(draws, [0.05, 0.95])
    thin = draws[np.linspace(0, draws.size - 1, RANKS).astype(int)]
    z = float((truth - draws.mean()) / (draws.std() + 1e-300))
    return {"rank": int((thin < truth).sum()), "covered": bool(lo <= truth <= hi), "z": z}


def summarise(results) -> dict:
    """Coverage and rank uniformity per quantity over the converged units."""
    good = [r for r in results if r["converged"]]
    names = list(good[0]["quantities"])
    n = len(good)
    low, high = (int(v) for v in binom.interval(0.99, n, 0.9))
    table = {}
    for name in names:
        hits = sum(r["quantities"][name]["covered"] for r in good)
        counts = np.bincount([r["quantities"][name]["rank"] // 10 for r in good], minlength=10)
        table[name] = {"covered": hits, "share": hits / n, "inside_99_bounds": low <= hits <= high,
                       "rank_histogram": counts.tolist(), "rank_p_value": float(chisquare(counts).pvalue)}
    return {"units": len(results), "converged": n, "binomial_99_bounds": [low, high], "quantities": table,
            "median_seconds": float(np.median([r["seconds"] for r in results]))}


def keep(results, out) -> dict:
    """Write what is known so far and return its summary."""
    summary = summarise(results)
    (out / "calibration.json").write_text(json.dumps(summary | {"runs": results}, indent=1))
    return summary


def draw_ranks(summary, path):
    """Rank histograms of every quantity with the 99 % band of a uniform."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    table = summary["quantities"]
    columns = 6
    rows = -(-len(table) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(2.3 * columns, 1.6 * rows), sharex=True, sharey=True)
    lo, hi = binom.interval(0.99, summary["converged"], 0.1)
    for axis in axes.ravel()[len(table):]:
        axis.set_visible(False)
    for axis, (name, row) in zip(axes.ravel(), table.items(), strict=False):
        axis.axhspan(lo, hi, color="0.85")
        axis.bar(np.arange(10) + 0.5, row["rank_histogram"], width=1, color="#0072B2", edgecolor="white")
        axis.set_title(f"{name.replace('_', ' ')}\n{row['share']:.0%} covered", fontsize=8)
        axis.tick_params(labelsize=8)
    figure.supxlabel("rank of the truth among 99 draws, in tenths (grey: 99 % band of a calibrated posterior)", fontsize=9)
    figure.supylabel("units", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=120)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("reports/calibration"))
    options = parser.parse_args()
    seeds = range(options.first_seed, options.first_seed + options.units)
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    with ProcessPoolExecutor(options.workers) as pool:
        for result in pool.map(one_unit, seeds):
            results.append(result)
            bad = [k for k, v in result["quantities"].items() if abs(v["z"]) > 3.5]
            told = f"converged {result['converged']}, {result['seconds']:.1f} s, far off: {bad}"
            print(f"unit {result['seed']}: {told}", flush=True)
            if len(results) % 10 == 0:
                summary = keep(results, options.out)
    summary = keep(results, options.out)
    draw_ranks(summary, options.out / "ranks.png")
    for name, row in summary["quantities"].items():
        print(f"{name:32s} {row['share']:.3f} {'' if row['inside_99_bounds'] else 'OUTSIDE'} p={row['rank_p_value']:.3f}")


if __name__ == "__main__":
    main()
