"""Indicators of the synthetic twins against their noise-free answers at 0.05 N·m/s.

    python studies/twins.py --data ../shared/data/twins --out reports/twins
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import warnings
from pathlib import Path

import numpy as np

from backdrive_bayes.commands.results import FitOptions, fit_unit
from backdrive_bayes.records.unit_folder import read_unit

ARCMIN = np.pi / 10800
AMPLITUDES = (0.02, 0.04, 0.06, 0.08, 0.1)
ANSWERS = {
    "reducer-1": {"peak": (111.8, 111.7, 111.5), "S": (0.283, 0.301, 0.321, 0.343, 0.366),
                  "u": (0.819, 0.610, 0.434, 0.315, 0.237), "lost_motion": 32.6, "width": 99.9},
    "reducer-2": {"peak": (355.4, 350.4, 346.0), "S": (0.202, 0.463, 0.804, 1.315, 1.941),
                  "u": (0.275, 0.202, 0.206, 0.235, 0.260), "lost_motion": 46.7, "width": 2.8},
}
"""Angles in arcmin, S in mJ, of the reducers' settled loops; peaks at 0.01, 0.05 and 0.1 N·m/s. They come with the twins."""


def expected(unit, record):
    """(indicator, truth, factor to SI) of one record, as far as the answers know it."""
    answers, amplitude, rate = ANSWERS[unit], record["amplitude_Nm"], record["loading_rate_Nm_per_s"]
    if abs(amplitude - 0.1) < 0.005:
        yield "peak_angle_rad", answers["peak"][int(np.argmin(np.abs(np.array([0.01, 0.05, 0.1]) - rate)))], ARCMIN
    if abs(rate - 0.05) < 0.005:
        i = int(np.argmin(np.abs(np.array(AMPLITUDES) - amplitude)))
        yield "loop_area_J", answers["S"][i], 1e-3
        yield "dissipation_ratio", answers["u"][i], 1.0
        if i == 4:
            yield "lost_motion_rad", answers["lost_motion"], ARCMIN
            yield "zero_torque_width_rad", answers["width"], ARCMIN


def main():
    """Command line."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("../shared/data/twins"))
    parser.add_argument("--out", type=Path, default=Path("reports/twins"))
    options = parser.parse_args()
    rows = []
    for name in ANSWERS:
        posterior, result = fit_unit(read_unit(options.data / name), FitOptions(seed=1))
        for record in result["records"]:
            for indicator, truth, factor in expected(name, record):
                v = record["indicators"][indicator]
                lo, median, hi = (v[k] / factor for k in ("lo", "median", "hi"))
                rows.append({"unit": name, "record": record["file"], "indicator": indicator, "truth": truth, "median": median,
                             "lo90": lo, "hi90": hi, "covered": bool(lo <= truth <= hi), "converged": posterior.converged})
                found = f"{median:8.3f} [{lo:.3f}, {hi:.3f}] {'' if lo <= truth <= hi else 'MISSED'}"
                print(f"{name} {record['file']:28s} {indicator:22s} truth {truth:8.3f}  {found}", flush=True)
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "README.md").write_text(page(rows), encoding="utf-8")
    print(page(rows))


def page(rows) -> str:
    """The report in Markdown; the planted fault are answers that are 3 % larger."""
    share, wrong = (np.mean([r["lo90"] <= factor * r["truth"] <= r["hi90"] for r in rows]) for factor in (1.0, 1.03))
    lines = [
        "# The twins against their noise-free answers", "",
        f"Made by `python studies/twins.py`: 90 % intervals hold {share:.2f} of {len(rows)} answers; "
        f"of answers 3 % larger (planted fault) {wrong:.2f}. Angles in arcmin, S in mJ.", "",
        "| unit | record | indicator | answer | median | 90 % interval | |", "|" + "---|" * 7,
    ]  # fmt: skip
    for r in rows:
        word = ("" if r["covered"] else "missed") + ("" if r["converged"] else " not converged")
        interval = f"{r['median']:.3f} | [{r['lo90']:.3f}, {r['hi90']:.3f}]"
        lines.append(f"| {r['unit']} | {r['record']} | {r['indicator']} | {r['truth']:g} | {interval} | {word.strip()} |")
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main()
