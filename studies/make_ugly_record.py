"""Make data/ugly: one record with everything that goes wrong on a bench, from a model whose truth is known.

    python studies/make_ugly_record.py

Foreign column names and units, decimal commas, coarse time stamps, a start in mid-cycle, a dwell at the turning points, ripple on
the torque, lost samples, and an encoder that freezes for a moment.
"""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.known_truth import BenchNoise, KnownReducer, angle_noise, physical_reducer

RATED, ANGLE = 2.0, 0.02


def main():
    """Write data/ugly."""
    rng = np.random.default_rng(7)
    knots = np.array([0.6, 2.0, 2.0, -2.0, -2.0, 2.0, 2.0, -2.0, -2.0, 1.0])
    rest = np.abs(np.diff(knots)) < 1e-9
    corner = np.concatenate([[0.0], np.cumsum(np.where(rest, 0.3, np.abs(np.diff(knots)) / 0.5))])
    time = np.arange(0.0, corner[-1], 0.002)
    torque = np.interp(time, corner, knots)
    known = physical_reducer(rng, clearance=0.6, drag=0.03, engagement=0.3, compliance=0.6, friction=0.4, threshold=0.04)
    angle = KnownReducer(known.weights, RATED, ANGLE).angle_rad(time, torque)
    angle = angle + angle_noise(time.size, 0.002, BenchNoise(3e-5, 8e-5), rng) + 0.2
    measured = torque + 0.01 * rng.standard_normal(time.size) + 0.004 * np.sin(2 * np.pi * 11 * time)
    frozen = (time > 12.0) & (time < 12.06)
    angle[frozen] = angle[frozen][0]
    kept = rng.random(time.size) > 0.01
    kept[(time > 20.0) & (time < 20.1)] = False
    stamps = np.floor(time * 1000 / 8) * 8
    folder = Path("data/ugly")
    folder.mkdir(parents=True, exist_ok=True)
    rows = ["Zeit [ms];M [mNm];phi [deg]"]
    for t, m, a in zip(stamps[kept], 1e3 * measured[kept], np.degrees(angle[kept]), strict=True):
        rows.append(f"{t:.0f};{m:.2f};{a:.5f}".replace(".", ","))
    (folder / "bench.csv.gz").write_bytes(gzip.compress("\n".join(rows).encode() + b"\n", mtime=0))


if __name__ == "__main__":
    main()
