"""The key of a blind check: the truth about every unit, as bytes whose hash is published before anything is diagnosed."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from backdrive_bayes.bench.registry import NONE
from backdrive_bayes.bench.truth import BenchUnit
from backdrive_bayes.blind.request import Request
from backdrive_bayes.blind.where import rounded, true_map
from backdrive_bayes.errors import BadInput

SCHEMA = "backdrive-bayes/blind-key/1"


def label_of(names) -> str:
    """One label for a set of effects: 'none', the name, or the names of a pair in alphabetical order joined by '+'."""
    return "+".join(sorted(names)) or NONE


def key_entry(bench: BenchUnit, folder_sha256: str) -> dict:
    """The truth about one unit: ``height`` is its effects' largest [noise sd], ``severity`` as asked for, None for none."""
    planted = bench.truth.planted
    named = zip(bench.unit.records, bench.truth.records, strict=True)
    return {
        "unit": bench.unit.name,
        "folder_sha256": folder_sha256,
        "label": label_of(bench.truth.answer),
        "effects": list(bench.truth.answer),
        "planted": [
            {"name": p.name, "severity": p.severity, "height": rounded(p.height), "limited": bool(p.limited)} for p in planted
        ],
        "severity": max((p.severity for p in planted if p.answer in bench.truth.answer), default=None),
        "height": max((rounded(p.height) for p in planted), default=0.0),
        "limited": any(bool(p.limited) for p in planted),
        "where": {name: true_map(bench, f"{name}_rad") for name in ("remainder", "effect")},
        "indicators": [
            {"record": r.name, **{k: rounded(v) for k, v in t.indicators.items() if np.isfinite(v)}} for r, t in named
        ],
    }


def key_bytes(request: Request, entries) -> bytes:
    """The key as the bytes that are hashed and written."""
    key = {"schema": SCHEMA, "request": request.as_json(), "units": list(entries)}
    return (json.dumps(key, indent=1, allow_nan=False) + "\n").encode("ascii")


def read_key(data: bytes, sha256: str) -> dict:
    """The key from its bytes; BadInput where they do not have the hash that was published."""
    if digest(data) != sha256:
        raise BadInput("key.json", f"the key whose SHA-256 was published, {sha256[:12]}…", f"one with {digest(data)[:12]}…")
    return json.loads(data)


def digest(data: bytes) -> str:
    """SHA-256 of bytes as hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def folder_digest(folder: Path) -> str:
    """SHA-256 over names and contents of all files in a unit's folder."""
    lines = [f"{path.name} {digest(path.read_bytes())}\n" for path in sorted(Path(folder).iterdir())]
    return digest("".join(lines).encode())
