"""Do the intervals of a batch's mean and spread hold the truth, whatever the spread and the number of units?

    python studies/batch_pooling.py --batches 200

Batches are drawn with known mean and spread of a positive quantity, narrow and wide beside what one unit's data tell. Each unit
is 1600 posterior draws: every other one's likelihood is normal in the logarithm, the others' is skewed (a gamma reading), its
precision differs by a factor of four, and its prior is displaced by its own standard deviation. Faults are planted beside: a
prior that is left in, and posteriors half as wide as they are. Writes reports/batch-pooling/coverage.json.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import binom

from backdrive_bayes.pooling.quantity import pool_quantity

HOME = Path(__file__).parents[1] / "reports" / "batch-pooling"
UNITS, RATIOS = (5, 12, 40), (0.1, 1.0, 10.0)
"""Units of a batch, and its spread in a unit's standard deviation."""
OWN_SD, LEVEL, DRAWS, PRIOR_DRAWS, GRID = 0.2, 0.9, 1600, 1000, 2001
PRIOR_WIDTH, PRIOR_AWAY = 3.0, 1.0
"""Width of a unit's prior in that of the units' estimates, and how far off its centre lies, in its width."""
FAULTS = ("prior left in", "posteriors halved")
FAULTY = ((12, 0.1), (40, 0.1))
"""Where faults are planted: beside a spread much wider than what a unit's data tell neither of them matters."""
BOUND = 0.005


@dataclass(frozen=True, eq=False)
class Batch:
    """A simulated batch: true log mean, spread, units' true logs (units,), and lists of draws and prior draws of the quantity."""

    mean: float
    spread: float
    truth: np.ndarray
    draws: list
    priors: list


def simulate(units: int, ratio: float, rng) -> Batch:
    """Posterior draws of units that were fitted one by one."""
    mean, spread = float(rng.normal(-6.0, 1.0)), ratio * OWN_SD
    truth = mean + spread * rng.standard_normal(units)
    draws, priors, width = [], [], PRIOR_WIDTH * np.hypot(spread, OWN_SD)
    for i, x in enumerate(truth):
        sd, centre = OWN_SD * np.exp(rng.uniform(-np.log(2), np.log(2))), mean + PRIOR_AWAY * width
        grid = np.linspace(x - 12 * sd, x + 12 * sd, GRID)
        log_posterior = _log_likelihood(grid, x, sd, skewed=bool(i % 2), rng=rng) - 0.5 * ((grid - centre) / width) ** 2
        weight = np.cumsum(np.exp(log_posterior - log_posterior.max()))
        draws.append(np.exp(np.interp(rng.random(DRAWS), weight / weight[-1], grid)))
        priors.append(np.exp(centre + width * rng.standard_normal(PRIOR_DRAWS)))
    return Batch(mean, spread, truth, draws, priors)


def _log_likelihood(grid, x, sd, skewed, rng):
    """Of the log value on a grid, given one reading: normal in the logarithm, or the value times a gamma variate of mean one."""
    if not skewed:
        return -0.5 * ((grid - x - sd * rng.standard_normal()) / sd) ** 2
    shape = sd**-2
    reading = x + np.log(rng.gamma(shape) / shape)
    return shape * (reading - grid - np.exp(reading - grid))


def with_fault(batch: Batch, fault: str, rng) -> Batch:
    """The same batch as a faulty evaluation would see it."""
    draws, priors = batch.draws, batch.priors
    if fault == "prior left in":
        priors = [np.exp(100.0 * rng.standard_normal(PRIOR_DRAWS)) for _ in priors]
    if fault == "posteriors halved":
        draws = [np.exp(np.log(d).mean() + 0.5 * (np.log(d) - np.log(d).mean())) for d in draws]
    return Batch(batch.mean, batch.spread, batch.truth, draws, priors)


def one_batch(units: int, ratio: float, fault: str, seed: int) -> dict:
    """What was held of one batch, or that it was refused; the share of units whose pooled interval holds, and their shrinking."""
    rng = np.random.default_rng([seed, units, int(10 * ratio)])
    batch = with_fault(simulate(units, ratio, rng), fault, rng)
    found = pool_quantity([str(i) for i in range(units)], batch.draws, batch.priors, seed, LEVEL)
    if found["refused"]:
        return {"refused": found["refused"]}
    pooled = [(r, x) for r, x in zip(found["of_units"], batch.truth, strict=True) if r["pooled"]]
    another = batch.mean + batch.spread * rng.standard_normal()
    return {
        "refused": None,
        "mean": _holds(found["mean"], np.exp(batch.mean)),
        "spread": _holds(found["spread"], batch.spread),
        "next": _holds(found["next_unit"], np.exp(another)),
        "loss_bits": found["loss_bits"],
        "left": units - len(pooled),
        "units": [_holds(r["pooled"], np.exp(x)) for r, x in pooled],
        "narrower": [_width(r["pooled"]) / _width(r["own"]) for r, _ in pooled],
    }


def _holds(found, true) -> bool:
    return bool(found["lo"] <= true <= found["hi"])


def _width(found) -> float:
    return float(np.log(found["hi"] / found["lo"]))


def cell(units: int, ratio: float, fault: str, batches: int) -> dict:
    """Coverage over so many batches, the binomial bounds that it is held against, and whether it keeps to the lower one."""
    began = time.perf_counter()
    results = [one_batch(units, ratio, fault, seed) for seed in range(batches)]
    found = [r for r in results if not r["refused"]]
    low, high = (float(end) for end in np.asarray(binom.ppf([BOUND, 1 - BOUND], len(found), LEVEL)) / len(found))
    shares = {name: float(np.mean([r[name] for r in found])) for name in ("mean", "spread", "next")}
    return {
        "units": units, "ratio": ratio, "fault": fault, "batches": batches, "refused": batches - len(found), **shares,
        "of_units": float(np.mean([h for r in found for h in r["units"]])),
        "narrower": float(np.median([w for r in found for w in r["narrower"]])),
        "units_refused": sum(r["left"] for r in found), "loss_bits": float(np.median([r["loss_bits"] for r in found])),
        "bounds": [low, high], "holds": bool(min(shares["mean"], shares["spread"]) >= low),
        "seconds_a_batch": (time.perf_counter() - began) / batches,
    }  # fmt: skip


def main():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batches", type=int, default=200)
    parser.add_argument("--out", type=Path, default=HOME)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    cells = []
    wanted = [(n, r, "none") for n in UNITS for r in RATIOS] + [(*c, fault) for fault in FAULTS for c in FAULTY]
    for units, ratio, fault in wanted:
        cells.append(cell(units, ratio, fault, given.batches))
        print(json.dumps(cells[-1]), flush=True)
        (given.out / "coverage.json").write_text(json.dumps(cells, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
