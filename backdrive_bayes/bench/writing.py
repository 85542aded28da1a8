"""A bench unit on disk: the unit's folder as the contract has it, and the truth as one JSON object kept apart."""

from __future__ import annotations

import gzip
import io
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.registry import EFFECTS
from backdrive_bayes.bench.truth import BenchUnit, PlantedEffect, RecordTruth
from backdrive_bayes.records.record import Record

ARCMIN = 10800.0 / np.pi
TRUTH_SCHEMA = "backdrive-bayes/bench-truth/2"
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
    records = zip(bench.unit.records, truth.records, strict=True)
    return plain(
        {
            "schema": TRUTH_SCHEMA,
            "unit": bench.unit.name,
            "bench": truth.bench,
            "kind": truth.kind,
            "answer": truth.answer,
            "planted": [_planted(p) for p in truth.planted],
            "reducer": truth.reducer,
            "noise": truth.noise,
            "chain": truth.chain,
            "rig": truth.rig,
            "traces": [
                {"name": t.name, "height_in_noise_sd": t.height, "parameters": t.effect.parameters()} for t in truth.traces
            ],
            "records": [{"record": record.name, **_curves(own)} for record, own in records],
            "held": _named(truth.held),
        }
    )


def plain(value):
    """A value of dataclasses, mappings, sequences and arrays as JSON has it."""
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return [plain(v) for v in value] if isinstance(value, tuple | list) else value


def _planted(planted: PlantedEffect) -> dict:
    return {
        "name": planted.name,
        "answer": planted.answer,
        "unlisted": planted.name not in EFFECTS,
        "severity": planted.severity,
        "height_in_noise_sd": planted.height,
        "limited": planted.limited,
        "of_reducer": planted.effect.of_reducer,
        "parameters": planted.effect.parameters(),
    }


def _curves(own: RecordTruth) -> dict:
    every = max(1, own.torque_nm.size // _POINTS)
    named = _named(own)
    indicators = {name: named.pop(name) for name in ("indicators", "clean_indicators")}
    return {**indicators, "every": every, **{name: curve[::every] for name, curve in named.items()}}


def _named(value) -> dict:
    """Fields with the units' own capitals, as all files spell them."""
    return {f.name.replace("_nm", "_Nm"): getattr(value, f.name) for f in fields(value)}


def _csv_gz(record: Record) -> bytes:
    table = np.column_stack([record.time_s, record.torque_nm, record.angle_rad * ARCMIN])
    text = io.StringIO()
    text.write("time_s,torque_Nm,angle_arcmin\n")
    digits = [6, _decimals(table[:, 1]), _decimals(table[:, 2])]
    np.savetxt(text, table, fmt=",".join(f"%.{n}f" for n in digits))
    return gzip.compress(text.getvalue().encode("ascii"), mtime=0)


def _decimals(values) -> int:
    """Decimals that tell about a millionth of the values' range, 1 at least."""
    return int(np.clip(6 - np.floor(np.log10(np.ptp(values))), 1, 12))
