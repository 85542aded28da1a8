"""Draw the units of a blind check and write their folders; the truth is returned, never written here."""

from __future__ import annotations

import os
import secrets
import shutil
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.bench.writing import write_unit
from backdrive_bayes.blind.key import folder_digest, key_entry
from backdrive_bayes.blind.request import Request, assign, draw_plan


def unit_name(index: int) -> str:
    """Name and folder of the unit with this index from 0."""
    return f"unit-{index + 1:04d}"


def assignments(request: Request) -> list[dict[str, float]]:
    """Effects of every unit of a request."""
    return assign(request, np.random.default_rng([request.seed, 0]))


def draw_and_write(request: Request, index: int, effects: dict[str, float], units: Path) -> dict:
    """Write one unit into its folder below ``units`` and return its entry of the key; equal arguments give equal bytes.

    A folder that is there with the same bytes is left alone.
    """
    rng = np.random.default_rng([request.seed, 1, index])
    plan, name = draw_plan(request, rng), unit_name(index)
    with threadpool_limits(1):  # sums in another order would change last bits
        bench = draw_unit(rng, effects, plan=plan, soil=request.dirt, reserved=request.reserved, name=name)
    part = Path(units) / f".{name}.{secrets.token_hex(4)}.part"
    part.mkdir()
    try:
        write_unit(bench, part)
        entry = key_entry(bench, folder_digest(part))
        _put(part, Path(units) / name, entry["folder_sha256"])
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return entry


def _put(part, folder, sha256):
    if folder.exists() and folder_digest(folder) == sha256:
        return
    shutil.rmtree(folder, ignore_errors=True)
    os.rename(part, folder)
