"""Make the packaged fleet: a dozen small units of one kind of reducer in two batches, the second with more clearance.

    python studies/make_fleet.py --out data/fleet

One loop a unit at 100 Hz. The truth is of the model's own class: the fleet shows the evaluation of many units and tests no model.
"""

import argparse
import gzip
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.known_truth import BenchNoise, physical_reducer, simulate_record

RATE, HERTZ = 0.05, 100.0
ARCMIN = 10800.0 / np.pi


def make_unit(folder: Path, number: int, batch: str, clearance: float, seed: int) -> None:
    """Write one unit: a reducer near the physical family, its clearance a share of the usual one."""
    rng = np.random.default_rng([seed, number])
    known = physical_reducer(rng, clearance=0.9 * clearance * np.exp(0.04 * rng.standard_normal()), scatter=0.03)
    record = simulate_record("loop.csv.gz", known, 0.1, RATE, BenchNoise(), rng, HERTZ)
    rows = "\n".join(
        f"{t:.3f},{q:.7f},{a * ARCMIN:.5f}" for t, q, a in zip(record.time_s, record.torque_nm, record.angle_rad, strict=True)
    )
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "loop.csv.gz").write_bytes(gzip.compress(f"time_s,torque_Nm,angle_arcmin\n{rows}\n".encode(), mtime=0))
    (folder / "unit.toml").write_text(
        f'schema = "backdrive-bayes/unit/1"\nname = "fleet-{number:02d}"\nserial = "A{100 + number}"\nbatch = "{batch}"\n'
        f'origin = "synthetic, of the model\'s own class; not a measurement"\nrated_torque_Nm = 0.1\n\n'
        f'[[record]]\nfile = "loop.csv.gz"\nloading_rate_Nm_per_s = {RATE}\namplitude_Nm = 0.1\n',
        encoding="utf-8",
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--units", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for number in range(1, args.units + 1):
        second = number > args.units // 2
        batch = "spring" if not second else "autumn"
        make_unit(args.out / batch / f"unit-{number:02d}", number, batch, 1.25 if second else 1.0, args.seed)


if __name__ == "__main__":
    main()
