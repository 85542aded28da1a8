"""Reading what commands have saved: JSON objects and posterior files. It knows neither model nor sampler."""

from __future__ import annotations

import json
from pathlib import Path

from backdrive_bayes.errors import BadInput

INDICATORS = "backdrive-bayes/indicators/1"
DIAGNOSIS = "backdrive-bayes/diagnosis/1"
VERDICT = "backdrive-bayes/verdict/1"
COMPARISON = "backdrive-bayes/comparison/1"
BLIND = "backdrive-bayes/blind/1"
POSTERIOR = "backdrive-bayes/posterior/2"
UNREADABLE = (OSError, ValueError, LookupError, RuntimeError, TypeError, AttributeError, ArithmeticError, MemoryError)
"""What the readers of HDF5 raise on a damaged file."""


def read_result(path: Path, schema: str) -> dict:
    """A result file's object; BadInput where it is missing, no JSON or of another schema."""
    try:
        loaded = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BadInput(path, "a result file", "no such file") from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise BadInput(path, "a JSON result file", f"unreadable file ({type(error).__name__})") from None
    found = loaded.get("schema") if isinstance(loaded, dict) else None
    if found != schema:
        raise BadInput(path, f"schema '{schema}'", repr(found))
    return loaded


def read_group(path: Path, group: str):
    """One group of a posterior file as an xarray dataset in memory; BadInput where the file is not one of ours."""
    import xarray

    try:
        with xarray.open_dataset(path, group=group, engine="h5netcdf") as dataset:
            loaded = dataset.load()
    except UNREADABLE as error:
        raise BadInput(path, f"a posterior.nc with group '{group}'", f"unreadable file ({type(error).__name__})") from None
    if loaded.attrs.get("schema") != POSTERIOR:
        raise BadInput(path, f"schema '{POSTERIOR}'", repr(loaded.attrs.get("schema")))
    return loaded
