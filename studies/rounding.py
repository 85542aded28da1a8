"""Does the last digit decide? Fits and diagnoses of records whose samples were shaken by 1e-12 of their range.

    python studies/rounding.py UNIT [UNIT …] [--shakes 2] [--seconds 600]

No probability may move by more than 0.005 and no interval's end by more than 0.5 % of its width. Written:
reports/rounding/README.md.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from backdrive_bayes.commands.results import FitOptions, diagnose_unit
from backdrive_bayes.records.unit_folder import read_unit

HOME = Path(__file__).parents[1] / "reports" / "rounding"
SHAKEN, PLANTED = 1e-12, 1e-3
"""Shares of a channel's range by which samples are shaken: of the last digits, and as a planted fault."""
MOST_PROBABILITY, MOST_END = 0.005, 0.005


def shaken(unit, size: float, rng):
    """The unit with torque and angle of every sample moved by about ``size`` of their ranges; without the files' digests."""
    def moved(values):
        return values + size * np.ptp(values) * rng.standard_normal(values.size)

    records = [replace(r, torque_nm=moved(r.torque_nm), angle_rad=moved(r.angle_rad)) for r in unit.records]
    return replace(unit, records=tuple(records), file_sha256="")


def answers(unit):
    """Probabilities by effect, and ends of every indicator's interval by record, (indicators, 2)."""
    result, (_, fitted) = diagnose_unit(unit, FitOptions())
    ends = [[v["lo"], v["hi"]] for r in fitted["records"] for v in r["indicators"].values() if v]
    return {row["effect"]: row["probability"] for row in result["which"]}, np.array(ends)


def apart(one, other) -> tuple[float, float]:
    """Largest difference of a probability, and of an interval's end in widths."""
    (p, ends), (q, others) = one, other
    return max(abs(p[n] - q[n]) for n in p), float((np.abs(ends - others) / np.ptp(ends, axis=1)[:, None]).max())


def main() -> None:
    """Parse, run within the time, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("units", nargs="+", type=Path)
    parser.add_argument("--shakes", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=1e9, help="nothing is begun after so many seconds")
    parser.add_argument("--out", type=Path, default=HOME)
    args = parser.parse_args()
    began, rows = time.perf_counter(), []
    for path in args.units:
        unit = replace(read_unit(path), file_sha256="")
        plain = answers(unit)
        for size, count in ((SHAKEN, args.shakes), (PLANTED, 1)):
            for k in range(count):
                if time.perf_counter() - began > args.seconds:
                    break
                moved = answers(shaken(unit, size, np.random.default_rng(k)))
                rows.append((f"{path.parent.name}/{path.name}", size, *apart(plain, moved)))
                print(*rows[-1], flush=True)
    small = [r for r in rows if r[1] == SHAKEN]
    held = all(r[2] <= MOST_PROBABILITY and r[3] <= MOST_END for r in small)
    lines = [
        "# Stability to rounding", "",
        f"Made by `python studies/rounding.py`: {len(small)} diagnoses with their fits, samples shaken by {SHAKEN:g} of a "
        f"channel's range. Largest change of a probability {max(r[2] for r in small):.1e} (allowed {MOST_PROBABILITY}), of an "
        f"interval's end {max(r[3] for r in small):.1e} of its width (allowed {MOST_END}): {'held' if held else 'NOT held'}.", "",
        f"Shaken by {PLANTED:g} (planted fault) the same figures must move.", "",
        "| unit | shaken by | probability moves by | interval's end by, widths |", "|---|---|---|---|",
        *(f"| {name} | {size:g} | {p:.1e} | {end:.1e} |" for name, size, p, end in rows), "",
    ]  # fmt: skip
    args.out.mkdir(parents=True, exist_ok=True)
    (args.out / "README.md").write_text("\n".join(lines), encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
