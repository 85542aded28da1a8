"""Reader of MATLAB files, both the classic format and version 7.3 (HDF5)."""

from __future__ import annotations

import math
import zlib
from pathlib import Path

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows, finite_columns

_HDF5_MARK_AT = 512  # version 7.3 is HDF5 behind a 512-byte MATLAB header


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen variables, which must be vectors; their length is checked before any is read."""
    with path.open("rb") as file:
        start = file.read(_HDF5_MARK_AT + 8)
    hdf5 = any(start[at : at + 4] == b"\x89HDF" for at in (0, _HDF5_MARK_AT))
    wanted, arrays = (_read_hdf5 if hdf5 else _read_classic)(path, choose)
    return finite_columns(path, wanted, arrays)


def _read_classic(path: Path, choose: Choose):
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import MatReadError

    try:
        shapes = {name: shape for name, shape, _ in whosmat(path)}
        wanted = _chosen(path, shapes, choose)
        content = loadmat(path, variable_names=wanted, squeeze_me=False)
    except BadInput:
        raise
    except (
        MatReadError,
        ValueError,
        TypeError,
        KeyError,
        OSError,
        EOFError,
        zlib.error,
        NotImplementedError,
    ) as error:
        raise BadInput(path, "a MATLAB file", str(error)[:120] or type(error).__name__) from error
    return wanted, [content[name] for name in wanted]


def _read_hdf5(path: Path, choose: Choose):
    import h5py

    try:
        with h5py.File(path, "r") as file:
            local = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
            shapes = {
                name: file[name].shape
                for name in local
                if isinstance(file[name], h5py.Dataset) and not file[name].external
            }
            wanted = _chosen(path, shapes, choose)
            return wanted, [file[name][()] for name in wanted]
    except BadInput:
        raise
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise BadInput(path, "a MATLAB 7.3 file", str(error)[:120]) from error


def _chosen(path: Path, shapes: dict, choose: Choose) -> list[str]:
    wanted = list(choose(tuple(shapes)))
    for name in wanted:
        size = math.prod(shapes[name])
        if size != max(shapes[name], default=0):
            raise BadInput(f"{path}, variable '{name}'", "a vector", f"shape {tuple(shapes[name])}")
        check_rows(path, size)
    return wanted
