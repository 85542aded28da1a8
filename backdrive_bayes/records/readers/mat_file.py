"""Reader of MATLAB files, both the classic format and version 7.3 (HDF5)."""

from __future__ import annotations

import math
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows, finite_columns

_HDF5_MARK_AT = 512  # version 7.3 is HDF5 behind a 512-byte MATLAB header
_MOST_DEPTH = 4  # structures within structures
_MOST_ITEMS = 5000


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen variables, which must be vectors; their length is checked before any is read."""
    with path.open("rb") as file:
        start = file.read(_HDF5_MARK_AT + 8)
    hdf5 = any(start[at : at + 4] == b"\x89HDF" for at in (0, _HDF5_MARK_AT))
    wanted, arrays = (_read_hdf5 if hdf5 else _read_classic)(path, choose)
    return finite_columns(path, wanted, arrays)


def _read_classic(path: Path, choose: Choose):
    from scipy.io import loadmat, whosmat

    try:
        listed = whosmat(path)
        structs = [name for name, _, kind in listed if kind == "struct"]
        found = {name: shape for name, shape, kind in listed if kind != "struct"}
        fields = _fields(path, loadmat(path, variable_names=structs, squeeze_me=False)) if structs else {}
        shapes = found | {name: value.shape for name, value in fields.items()}
        wanted = _chosen(path, shapes, choose)
        plain = [name for name in wanted if name in found]
        content = loadmat(path, variable_names=plain, squeeze_me=False) if plain else {}
    except (BadInput, MemoryError):
        raise
    # The parser raises nearly anything at damaged bytes, assertions and unbound names among it.
    except Exception as error:
        raise BadInput(path, "a MATLAB file", str(error)[:120] or type(error).__name__) from error
    return wanted, [content[name] if name in found else fields[name] for name in wanted]


def _fields(path: Path, content: dict) -> dict:
    """Numeric fields of structures, by their own name where it is the only one, else with the structure's in front."""
    found, waiting = [], [(name, value, 0) for name, value in content.items() if not name.startswith("__")]
    while waiting:
        name, value, depth = waiting.pop()
        if getattr(value, "dtype", None) is None or depth > _MOST_DEPTH:
            continue
        if value.dtype.names and value.size == 1:
            waiting += [(f"{name}.{field}", value[field].ravel()[0], depth + 1) for field in value.dtype.names]
        elif value.dtype.kind in "fiu" and value.size == max(value.shape, default=0) > 1:
            found.append((name, value))
    return _shortest_names(found)


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

    found, waiting = [], [("", file, 0)]
    while waiting:
        prefix, group, depth = waiting.pop()
        local = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink) and name != "#refs#"]
        for name, item in ((prefix + name, group[name]) for name in local):
            if len(found) + len(waiting) > _MOST_ITEMS:
                raise ValueError(f"more than {_MOST_ITEMS} variables")
            if isinstance(item, h5py.Dataset) and _is_plain(item):
                found.append((name, item))
            elif isinstance(item, h5py.Group) and depth < _MOST_DEPTH:
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
