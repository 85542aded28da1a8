"""Reading what commands have saved: JSON objects and posterior files. It knows neither model nor sampler."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.result_file import SHAPES, require_whole

INDICATORS = "backdrive-bayes/indicators/1"
DIAGNOSIS = "backdrive-bayes/diagnosis/1"
VERDICT = "backdrive-bayes/verdict/1"
COMPARISON = "backdrive-bayes/comparison/1"
BLIND = "backdrive-bayes/blind/1"
CHECK = "backdrive-bayes/check/1"
PREDICTION = "backdrive-bayes/prediction/1"
FLEET = "backdrive-bayes/fleet/1"
POOL = "backdrive-bayes/pool/1"
POSTERIOR = "backdrive-bayes/posterior/7"
GROUPS = ("posterior", "unconstrained_posterior", "sample_stats", "posterior_predictive", "observed_data", "constant_data")
"""The groups of a posterior file."""
SEAL = "content_sha256"
"""Attribute of every group: the digest of all of them."""
UNREADABLE = (OSError, ValueError, LookupError, RuntimeError, TypeError, AttributeError, ArithmeticError, MemoryError)
"""What the readers of HDF5 raise on a damaged file."""


def usable(result: dict) -> bool:
    """Whether the numbers of a fit or a diagnosis may be used: it came out, and the data were not forced."""
    return not result["outcome"]["exit_code"] and not result.get("forced", False)


def read_result(path: Path, schema: str) -> dict:
    """A result file's object; BadInput where it is missing, no JSON, of another schema, or lacks a key of it."""
    try:
        loaded = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise BadInput(path, "a result file", "no such file") from None
    except (OSError, ValueError, RecursionError) as error:
        why = "nested too deeply" if isinstance(error, RecursionError) else type(error).__name__
        raise BadInput(path, "a JSON result file", f"unreadable file ({why})") from None
    found = loaded.get("schema") if isinstance(loaded, dict) else None
    if found != schema:
        raise BadInput(path, f"schema '{schema}'", repr(found))
    if schema in SHAPES:
        require_whole(loaded, schema, path)
    return loaded


def read_group(path: Path, group: str):
    """One group of a posterior file as an xarray dataset in memory; BadInput where the file is not one of ours."""
    return _read(path, (group,))[group]


def read_groups(path: Path) -> dict:
    """All groups of a posterior file by name; BadInput where it is not as it was written."""
    groups = _read(path, GROUPS)
    try:
        whole = {g.attrs.get(SEAL) for g in groups.values()} == {digest_of(groups)}
    except (TypeError, ValueError):
        whole = False
    if not whole:
        raise BadInput(path, "the file as it was written", "changed or missing bytes (fit the unit again)")
    return groups


def _read(path, names):
    """Groups of a posterior file by name, the file opened once: xarray's own reader opens it anew for each and looks every
    variable up a hundred times.
    """
    import h5py

    loaded, name = {}, names[0]
    if not path.is_file():
        raise BadInput(path, "the posterior.nc of a fit", "a folder" if path.is_dir() else "nothing there")
    try:
        with h5py.File(path) as file:
            for name in names:
                loaded[name] = _dataset(file[name])
    except UNREADABLE as error:
        raise BadInput(path, f"a posterior.nc with group '{name}'", f"unreadable file ({type(error).__name__})") from None
    for found in (group.attrs.get("schema") for group in loaded.values()):
        if found != POSTERIOR:
            raise BadInput(path, f"schema '{POSTERIOR}'", repr(found))
    return loaded


def _dataset(group):
    """An HDF5 group in netCDF's conventions as an xarray dataset: dimensions are named by the scales attached to them."""
    import xarray

    held = {name: item for name, item in group.items() if not item.is_scale}
    variables = {n: ([scales[0].name.rsplit("/", 1)[1] for scales in item.dims], item[()]) for n, item in held.items()}
    return xarray.Dataset(variables, attrs={n: a if isinstance(a, str) else a.item() for n, a in group.attrs.items()})


def digest_of(groups: dict) -> str:
    """SHA-256 of the names, values and attributes of datasets by group, the seal itself left out."""
    seal = hashlib.sha256()
    for name in sorted(groups):
        attributes = {k: str(v) for k, v in groups[name].attrs.items() if k != SEAL}
        seal.update(json.dumps([name, attributes], sort_keys=True).encode())
        for variable in sorted(map(str, groups[name].data_vars)):
            values = np.ascontiguousarray(groups[name][variable].values)
            seal.update(f"{variable}{values.shape}{values.dtype.kind}{values.dtype.itemsize}".encode() + values.tobytes())
    return seal.hexdigest()


def require_own_posterior(path: Path, attributes: dict, about: dict) -> None:
    """BadInput unless the posterior file with these attributes is the one that an indicators object was written with."""
    own = {"unit": attributes.get("unit"), "data_sha256": str(attributes.get("data_sha256")).split(",")}
    _require_equal(path, own, about, ("unit", "data_sha256"))
    _require_equal(path, {"posterior_sha256": attributes.get(SEAL)}, about, ("posterior_sha256",))


def require_same_data(path: Path, result: dict, about: dict, version: bool = True) -> None:
    """BadInput unless the result at ``path`` is of the unit, the data and (unless it rests on the fit) the version of an
    indicators object, and of its ``k``; a verdict also of its posterior, where it says on which it rests.
    """
    require_same_records(path, result, about)
    _require_equal(path, result, about, ("unit_sha256", *(("version",) if version else ())))
    _require_alike(path, "k", result["options"].get("k"), about["options"].get("k"))


def require_same_records(path: Path, result: dict, about: dict) -> None:
    """BadInput unless the result at ``path`` is of the unit and the data of an indicators object, and of its posterior where it
    says on which it rests."""
    _require_equal(path, result, about, ("unit", "data_sha256"))
    _require_alike(path, "posterior_sha256", result.get("posterior_sha256"), about.get("posterior_sha256"))


def _require_alike(path, key, found, own):
    if found and own:
        _require_equal(path, {key: found}, {key: own}, (key,))


_NAMES = {
    "unit": "a result of unit",
    "data_sha256": "data with SHA-256",
    "unit_sha256": "a unit file with SHA-256",
    "version": "a result of version",
    "posterior_sha256": "the posterior with SHA-256",
    "k": "lost motion at the share of T_r",
}


def _require_equal(path, result, about, keys):
    for key in keys:
        if about.get(key) is None:
            raise BadInput(path, "complete result files in one folder", f"one without '{key}' (compute it again)")
        if result.get(key) != about[key]:
            raise BadInput(path, f"{_NAMES[key]} {_shown(about.get(key))}, as indicators.json has", _shown(result.get(key)))


def _shown(value) -> str:
    values = value if isinstance(value, list) else [value]
    return ", ".join("none" if v in (None, "") else str(v)[:12 if len(str(v)) == 64 else 60] for v in values[:4]) or "none"
