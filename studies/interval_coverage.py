"""Do 90 % intervals hold the truth on clean units of virtual benches that share nothing with the class?

    python studies/make_bench.py /tmp/contact --bench contact --units 24 --seed 2611 --clean
    python studies/interval_coverage.py contact=/tmp/contact ode=/tmp/ode --workers 2

Each clean unit of a folder made by studies/make_bench.py is fitted as the command `fit` does; the page
reports/interval-coverage/README.md says how
often the intervals of each indicator hold the reducer's own loop, how wide they are, and what binomial 99 % bounds allow.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from scipy.stats import binom

from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.records.unit_folder import read_unit

HOME = Path(__file__).parents[1] / "reports" / "interval-coverage"
TRUTH = {
    "lost_motion_rad": "lost_motion_rad",
    "zero_torque_width_rad": "backlash_rad",
    "loop_area_J": "area_J",
    "absorbed_J": "absorbed_J",
    "dissipation_ratio": "dissipation_ratio",
    "peak_angle_rad": "peak_rad",
}


def one_unit(folder: Path, truth: dict) -> dict:
    """Whether each record's intervals hold the truth, and their relative half widths."""
    posterior, result = fit_unit(read_unit(folder), FitOptions())
    rows = []
    for record in result["records"]:
        rate = record["loading_rate_Nm_per_s"]
        true = _own(truth, record["file"]) or truth["indicators"][min(truth["indicators"], key=lambda r: abs(float(r) - rate))]
        for name, key in TRUTH.items():
            found = record["indicators"].get(name)
            if found:
                held = found["lo"] <= true[key] <= found["hi"]
                rows.append((name, held, 0.5 * (found["hi"] - found["lo"]) / abs(true[key])))
    return {"converged": posterior.converged, "rows": rows}


def _own(truth, file):
    return next((r["indicators"] for r in truth.get("records", []) if r["file"] == file), None)


def run_bench(folder: Path, workers: int, most: int) -> dict:
    """Coverage and median half width of each indicator on a folder's clean units."""
    key = json.loads((folder / "key.json").read_text())
    clean = [c for c, v in key.items() if not v["effects"]][:most]
    with ProcessPoolExecutor(workers) as pool:
        found = list(pool.map(one_unit, [folder / c for c in clean], [key[c] for c in clean]))
    table = {"units": len(found), "converged": sum(f["converged"] for f in found)}
    for name in TRUTH:
        rows = [r for f in found for r in f["rows"] if r[0] == name]
        table[name] = (len(rows), float(np.mean([r[1] for r in rows])), float(np.median([r[2] for r in rows])))
    return table


def main() -> None:
    """Parse, run, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benches", nargs="+", metavar="NAME=FOLDER")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--most", type=int, default=1000, help="units of each bench at most")
    args = parser.parse_args()
    lines = [
        "# Coverage of 90 % intervals on clean units",
        "",
        "Made by `python studies/interval_coverage.py`. Share of intervals that hold the",
    ]
    lines += ["reducer's own loop (median relative half width); records of one unit count as one in the bounds.", ""]
    lines += ["| bench | units | converged | " + " | ".join(TRUTH) + " | 99 % bounds |", "|---" * (len(TRUTH) + 4) + "|"]
    for text in args.benches:
        name, _, folder = text.partition("=")
        table = run_bench(Path(folder), args.workers, args.most)
        low, high = binom.ppf([0.005, 0.995], table["units"], 0.9) / table["units"]
        cells = [f"{c:.2f} (±{100 * w:.1f} %)" for _, c, w in (table[n] for n in TRUTH)]
        lines.append(
            f"| {name} | {table['units']} | {table['converged']} | " + " | ".join(cells) + f" | {low:.2f} – {high:.2f} |"
        )
        print(lines[-1], flush=True)
    HOME.mkdir(parents=True, exist_ok=True)
    (HOME / "README.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
