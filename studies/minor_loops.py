"""Minor loops at a rate that was never fitted, predicted from the fits of clean units of the virtual benches.

    python studies/minor_loops.py contact=/tmp/b/contact ode=/tmp/b/ode --most 3 --seconds 900

Every clean unit of a folder made by studies/make_bench.py is fitted as the command `fit` does; its posterior predicts the record
that the bench held back: eleven turning points between -0.9 and 0.9 T_r, another rate, no noise. The encoder's offset is unknown
and taken out of every curve as the median difference. Written: reports/minor-loops/README.md and loops.png.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import json
import time
from pathlib import Path

import numpy as np

from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.engine.prediction import nodes, predict_angles
from backdrive_bayes.records.unit_folder import read_unit

HOME = Path(__file__).parents[1] / "reports" / "minor-loops"
BAND = (0.05, 0.95)


def one_unit(folder: Path, held: dict, seed: int) -> dict:
    """Error [share of the range], share of the points inside the 90 % band, half width of it; and curves for the figure."""
    posterior, _ = fit_unit(read_unit(folder), FitOptions(seed=seed))
    time_s, torque, truth = (np.array(held[k]) for k in ("time", "torque", "angle"))
    at = nodes(torque)
    curves = predict_angles(posterior, time_s, torque)
    # Each curve has one record's offset: what is left are shapes.
    curves = curves - np.median(curves - truth[at], axis=1, keepdims=True)
    shapes = {"torque": torque[at], "truth": truth[at], "curves": curves}
    return score(curves, truth[at]) | shapes | {"converged": posterior.converged}


def score(curves, truth) -> dict:
    """Of curves (draws, points) against the truth (points,)."""
    low, middle, high = np.quantile(curves, [BAND[0], 0.5, BAND[1]], axis=0)
    span = np.ptp(truth)
    inside = float(np.mean((low <= truth) & (truth <= high)))
    error = float(np.sqrt(np.mean((middle - truth) ** 2)) / span)
    return {"error": error, "inside": inside, "half_width": float(np.mean(high - low) / 2 / span)}


def swapped(found: list[dict]) -> float:
    """Planted fault: median share inside when each unit's band is laid about the next unit's truth, scaled alike."""
    shares = []
    for own, other in zip(found, found[1:] + found[:1], strict=True):
        truth = np.interp(np.linspace(0, 1, own["truth"].size), np.linspace(0, 1, other["truth"].size), other["truth"])
        truth = (truth - np.median(truth)) * np.ptp(own["truth"]) / np.ptp(truth)
        curves = own["curves"] - np.median(own["curves"] - truth, axis=1, keepdims=True)
        shares.append(score(curves, truth)["inside"])
    return float(np.median(shares))


def page(rows: list[tuple[str, str, dict]], left: int) -> str:
    """The report in Markdown; ``left`` units were not reached in the time."""
    found = [r for _, _, r in rows]
    errors, inside = np.array([r["error"] for r in found]), np.array([r["inside"] for r in found])
    lines = [
        "# Minor loops at another rate, never fitted", "",
        f"Made by `python studies/minor_loops.py`: {len(found)} clean units ({sum(r['converged'] for r in found)} converged; "
        f"{left} more were not reached in the time given).", "",
        f"Rms error of the range: median {100 * np.median(errors):.2f} %, largest {100 * errors.max():.2f} %. 90 % bands hold "
        f"{inside.mean():.2f} of the points in the mean over units, {inside.min():.2f} to {inside.max():.2f}. "
        f"Laid about another unit's loop (planted fault) they hold {swapped(found):.2f}.", "",
        "| bench | unit | rms, % of range | inside 90 % band | half width, % of range |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for bench, unit, r in rows:
        lines.append(f"| {bench} | {unit} | {100 * r['error']:.2f} | {r['inside']:.2f} | {100 * r['half_width']:.2f} |")
    return "\n".join([*lines, "", "![The best, the middle and the worst](loops.png)", ""])


def draw(rows, path: Path) -> None:
    """Loops of the best, the middle and the worst unit, and below them what the median misses by, with the band."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import MaxNLocator

    order = sorted(rows, key=lambda row: row[2]["error"])
    chosen = [order[0], order[len(order) // 2], order[-1]]
    figure, axes = plt.subplots(2, 3, figsize=(11, 5.6), height_ratios=(2, 1))
    for (bench, unit, r), (upper, lower) in zip(chosen, axes.T, strict=True):
        span = np.ptp(r["truth"])
        low, middle, high = np.quantile(r["curves"], [BAND[0], 0.5, BAND[1]], axis=0)
        upper.plot(r["torque"], 100 * r["truth"] / span, "k", lw=1.2, label="truth")
        upper.plot(r["torque"], 100 * middle / span, "--", color="#0072B2", lw=1, label="predicted")
        upper.set(title=f"{bench}, {unit}: {100 * r['error']:.2f} % of range", xlabel="torque, N·m", ylabel="angle, % of range")
        # What is not known of the start shows at the first points alone.
        point = np.arange(r["truth"].size)[r["truth"].size // 20 :]
        bounds = (100 * (edge - r["truth"])[point] / span for edge in (low, high))
        lower.fill_between(point, *bounds, color="#0072B2", alpha=0.3, lw=0, label="90 % band")
        lower.axhline(0, color="k", lw=0.8)
        lower.set(xlabel="point along the record", ylabel="less truth, %")
        upper.xaxis.set_major_locator(MaxNLocator(5))
    axes[0, 0].legend(frameon=False, fontsize=8)
    axes[1, 0].legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Parse, run within the time (benches take turns), write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("benches", nargs="+", metavar="NAME=FOLDER")
    parser.add_argument("--most", type=int, default=5, help="units of each bench at most")
    parser.add_argument("--seconds", type=float, default=1e9, help="no unit is begun after so many seconds")
    parser.add_argument("--out", type=Path, default=HOME)
    args = parser.parse_args()
    jobs = []
    for place, text in enumerate(args.benches):
        name, _, folder = text.partition("=")
        key = json.loads((Path(folder) / "key.json").read_text())
        clean = [c for c, v in key.items() if not v["effects"]][: args.most]
        jobs += [(i, place, name, Path(folder) / c, key[c]["held"]) for i, c in enumerate(clean)]
    began, rows = time.perf_counter(), []
    for seed, (_, _, name, folder, held) in enumerate(sorted(jobs, key=lambda job: job[:2])):
        if time.perf_counter() - began > args.seconds:
            break
        rows.append((name, folder.name, one_unit(folder, held, seed)))
        print(name, folder.name, {k: rows[-1][2][k] for k in ("error", "inside", "converged")}, flush=True)
    args.out.mkdir(parents=True, exist_ok=True)
    text = page(rows, len(jobs) - len(rows))
    (args.out / "README.md").write_text(text, encoding="utf-8")
    draw(rows, args.out / "loops.png")
    print(text)


if __name__ == "__main__":
    main()
