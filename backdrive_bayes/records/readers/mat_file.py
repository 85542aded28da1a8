"""Reader of MATLAB files, both the classic format and version 7.3 (HDF5)."""

from __future__ import annotations

import math
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.limits import MOST_ARRAYS, MOST_DEPTH, Choose, Columns, check_rows, finite_columns
from backdrive_bayes.records.readers.mat5 import is_level_5, leaves

_HDF5_MARK_AT = 512  # version 7.3 is HDF5 behind a 512-byte MATLAB header


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen variables, which must be vectors; their length is checked before any is read.

    Fields of structures go by their own name where it is the only one, else as 'structure.field'.
    """
    with path.open("rb") as file:
        start = file.read(_HDF5_MARK_AT + 8)
    if any(start[at : at + 4] == b"\x89HDF" for at in (0, _HDF5_MARK_AT)):
        wanted, arrays = _read_hdf5(path, choose)
    else:
        wanted, arrays = (_read_level_5 if is_level_5(start) else _read_level_4)(path, choose)
    return finite_columns(path, wanted, arrays)


def _read_level_5(path: Path, choose: Choose):
    try:
        found = _shortest_names([(leaf.name, leaf) for leaf in leaves(path.read_bytes())])
        wanted = _chosen(path, {name: leaf.shape for name, leaf in found.items()}, choose)
        return wanted, [found[name].values for name in wanted]
    except BadInput:
        raise
    except ValueError as error:
        raise BadInput(path, "a MATLAB file", str(error)[:120]) from error


def _read_level_4(path: Path, choose: Choose):
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    try:
        if matfile_version(path)[0] != 0:
            raise ValueError("another format")
        wanted = _chosen(path, {name: shape for name, shape, _ in whosmat(path)}, choose)
        content = loadmat(path, variable_names=wanted, squeeze_me=False)
    except (BadInput, MemoryError):
        raise
    # The parser raises nearly anything at damaged bytes.
    except Exception as error:
        raise BadInput(path, "a MATLAB file", str(error)[:120] or type(error).__name__) from error
    return wanted, [content[name] for name in wanted]


def _shortest_names(found: list) -> dict:
    last = [name.rpartition(".")[2] for name, _ in found]
    return {short if last.count(short) == 1 else name: value for short, (name, value) in zip(last, found, strict=True)}


def _read_hdf5(path: Path, choose: Choose):
    import h5py

    try:
        with h5py.File(path, "r") as file:
            found = _shortest_names(_datasets(file))
            wanted = _chosen(path, {name: data.shape for name, data in found.items()}, choose)
            return wanted, [found[name][()] for name in wanted]
    except BadInput:
        raise
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise BadInput(path, "a MATLAB 7.3 file", str(error)[:120]) from error


def _datasets(file) -> list:
    """All datasets of a file and of its structures, named 'structure.field'; links that leave the file are not followed."""
    import h5py

    found: list = []
    waiting = [("", file, 0)]
    while waiting:
        prefix, group, depth = waiting.pop()
        local = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink) and name != "#refs#"]
        for name, item in ((prefix + name, group[name]) for name in local):
            if len(found) + len(waiting) > MOST_ARRAYS:
                raise ValueError(f"more than {MOST_ARRAYS} variables")
            if isinstance(item, h5py.Dataset) and _is_plain(item):
                found.append((name, item))
            elif isinstance(item, h5py.Group) and depth < MOST_DEPTH:
                waiting.append((f"{name}.", item, depth + 1))
    return found


def _is_plain(item) -> bool:
    return item.dtype.kind in "fiu" and not item.external and not item.is_virtual


def _chosen(path: Path, shapes: dict, choose: Choose) -> list[str]:
    wanted = list(choose(tuple(shapes)))
    for name in wanted:
        size = math.prod(shapes[name])
        if size != max(shapes[name], default=0):
            raise BadInput(f"{path}, variable '{name}'", "a vector", f"shape {tuple(shapes[name])}")
        check_rows(path, size)
    return wanted
