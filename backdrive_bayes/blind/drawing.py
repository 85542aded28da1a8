"""Draw the units of a blind check and write their folders; the truth is returned, never written here."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np

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
    """Write one unit into its folder below ``units`` and return its entry of the key; equal arguments give equal bytes."""
    rng = np.random.default_rng([request.seed, 1, index])
    plan, name = draw_plan(request, rng), unit_name(index)
    bench = draw_unit(rng, effects, plan=plan, soil=request.dirt, reserved=request.reserved, name=name)
    folder = Path(units) / name
    folder.mkdir()
    write_unit(bench, folder)
    return key_entry(bench, folder_digest(folder))


def put(drawn: Path, folder: Path, sha256: str) -> None:
    """Move a drawn unit to its folder; one that is there with the same bytes is left alone."""
    if not (folder.exists() and folder_digest(folder) == sha256):
        shutil.rmtree(folder, ignore_errors=True)
        os.rename(drawn, folder)
