"""What verbs write through: the terminal, JSON files, and result folders that appear whole or not at all."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from backdrive_bayes.commands.parts import part
from backdrive_bayes.commands.stopping import unstopped
from backdrive_bayes.errors import BadInput

LONGEST_LINE = 2000
"""Characters of a complaint; what a hostile file makes a parser say has no end."""


def say(text: str = "") -> None:
    """Write one line of result to standard output; control characters in it are shown, not obeyed."""
    try:
        _write(sys.stdout, text)
    except BrokenPipeError:  # the reader (head, less) has seen enough; the verb's own exit code still counts
        sys.stdout = open(os.devnull, "w")


def complain(error: Exception | str) -> None:
    """Write the one line on standard error that goes with exit code 2."""
    if isinstance(error, OSError) and error.strerror:
        error = f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    line = in_encoding_of(sys.stderr, " ".join(str(error).split()))
    _write(sys.stderr, "backdrive-bayes: " + (line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 1]}…"))


def default_out(unit_name: str, verb: str) -> Path:
    """Folder ``<unit name>-<verb>`` in the working directory, with dashes for what no file name may hold."""
    safe = re.sub(r"[^\w.+-]+", "-", unit_name).strip(".-") or "unit"
    return Path(f"{safe[:80]}-{verb}")


@contextlib.contextmanager
def write_folder(out: Path | str) -> Iterator[Path]:
    """Yield a temporary folder that becomes ``out`` at the end; nothing stays behind on failure.

    Where ``out`` exists its files of the same names are replaced one by one and all others are left alone; what a killed
    process left beside it is taken away. Raises BadInput when ``out`` or a name in it is in the way.
    """
    require_out(out)
    out = Path(os.path.abspath(out))
    with part(out) as temporary:
        temporary.mkdir()
        yield temporary
        with unstopped():
            _move(temporary, out)


@contextlib.contextmanager
def write_file(path: Path | str) -> Iterator[Path]:
    """Yield the name of a temporary file that becomes ``path`` at the end, in one step."""
    path = Path(os.path.abspath(path))
    with part(path) as temporary:
        yield temporary
        os.replace(temporary, path)


def write_json(path: Path | str, obj) -> None:
    """Write ``obj`` as JSON in one step; numpy values become plain ones, NaN and infinities null."""
    text = json.dumps(_plain(obj), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    with write_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def require_out(out: Path | str) -> None:
    """BadInput where ``out`` cannot become a folder, because a file is in the way."""
    out = Path(os.path.abspath(out))
    if out.exists() and not out.is_dir():
        raise BadInput(out, "a folder to write into", "a file")
    with_file = next((folder for folder in out.parents if folder.exists()), None)
    if with_file is not None and not with_file.is_dir():
        raise BadInput(out, "a folder to write into", f"the file '{with_file}' in its path")


def _move(temporary: Path, out: Path) -> None:
    if not out.exists():
        os.rename(temporary, out)
        return
    files = [path.relative_to(temporary) for path in sorted(temporary.rglob("*")) if not path.is_dir()]
    for file in files:
        if (out / file).is_dir() or any((out / parent).is_file() for parent in file.parents):
            raise BadInput(out / file, "a file to replace", "a folder or file in its way")
    for file in files:
        (out / file).parent.mkdir(parents=True, exist_ok=True)
        os.replace(temporary / file, out / file)
    shutil.rmtree(temporary)


def _plain(obj):
    if isinstance(obj, dict):
        return {str(key): _plain(value) for key, value in obj.items()}
    if isinstance(obj, list | tuple):
        return [_plain(value) for value in obj]
    if isinstance(obj, np.ndarray | np.generic):
        return _plain(obj.tolist())
    if isinstance(obj, float):
        return obj if math.isfinite(obj) else None
    return str(obj) if isinstance(obj, os.PathLike) else obj


def in_encoding_of(stream, text: str) -> str:
    """Text that a stream can write: control characters, and those outside its encoding, are shown and not obeyed."""
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return _printable(text).encode(encoding, errors="backslashreplace").decode(encoding)


def _write(stream, text: str) -> None:
    stream.write(in_encoding_of(stream, text) + "\n")
    stream.flush()


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() or c in "\n\t" else repr(c)[1:-1] for c in text)
