"""A bench unit on disk: the unit's folder as the contract has it, and the truth as one JSON object kept apart."""

from __future__ import annotations

import gzip
import io
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.unit import BenchUnit, RecordTruth
from backdrive_bayes.records.record import Record

ARCMIN = 10800.0 / np.pi
TRUTH_SCHEMA = "backdrive-bayes/bench-truth/1"
_POINTS = 400


def write_unit(bench: BenchUnit, folder: Path) -> None:
    """Write unit.toml and one csv.gz a record into ``folder``, which exists; the same unit gives the same bytes."""
    unit = bench.unit
    lines = ['schema = "backdrive-bayes/unit/1"', f'name = "{unit.name}"', f"rated_torque_Nm = {unit.rated_torque_nm!r}"]
    lines += [f"reduction_ratio = {unit.reduction_ratio:g}"] if unit.reduction_ratio else []
    for record in unit.records:
        lines += ["", "[[record]]", f'file = "{record.name}"']
        lines += [f"loading_rate_Nm_per_s = {record.loading_rate_nm_per_s:.6g}", f"amplitude_Nm = {record.amplitude_nm:.6g}"]
        (Path(folder) / record.name).write_bytes(_csv_gz(record))
    (Path(folder) / "unit.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def truth_json(bench: BenchUnit) -> dict:
    """The truth of a unit, ready for JSON; noise-free curves thinned to some hundred points a record."""
    truth = bench.truth
    planted = [
        {
            "name": p.name,
            "answer": p.answer,
            "severity": p.severity,
            "height_in_noise_sd": p.height,
            "limited": p.limited,
            "parameters": p.effect.parameters(),
        }
        for p in truth.planted
    ]
    named = zip(bench.unit.records, truth.records, strict=True)
    return {
        "schema": TRUTH_SCHEMA,
        "unit": bench.unit.name,
        "answer": list(truth.answer),
        "planted": planted,
        "reducer": vars(truth.reducer),
        "noise": vars(truth.noise),
        "dirt": truth.dirt.parameters(),
        "records": [{"record": record.name, **_curves(own)} for record, own in named],
    }


def _curves(own: RecordTruth) -> dict:
    every = max(1, own.torque_nm.size // _POINTS)
    curves = {
        "torque_Nm": own.torque_nm,
        "angle_rad": own.angle_rad,
        "effect_rad": own.effect_rad,
        "remainder_rad": own.remainder_rad,
        "noise_rad": own.noise_rad,
    }
    return {"indicators": own.indicators, "every": every, **{k: v[::every] for k, v in curves.items()}}


def _csv_gz(record: Record) -> bytes:
    table = np.column_stack([record.time_s, record.torque_nm, record.angle_rad * ARCMIN])
    text = io.StringIO()
    text.write("time_s,torque_Nm,angle_arcmin\n")
    np.savetxt(text, table, fmt="%.6f,%.7f,%.4f")
    return gzip.compress(text.getvalue().encode("ascii"), mtime=0)
