"""What verbs write through: the terminal, JSON files, and result folders that appear whole or not at all."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import secrets
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

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

    Where ``out`` exists its files of the same names are replaced one by one and all others are left alone.
    Raises BadInput when ``out`` or a name in it is in the way.
    """
    out = Path(os.path.abspath(out))
    made = _make_parents(out)
    temporary = out.parent / f".{out.name[:80]}.{secrets.token_hex(4)}.part"
    try:
        temporary.mkdir()
        yield temporary
        _move(temporary, out)
    except BaseException:  # an interrupt too must leave nothing behind; it is raised again
        shutil.rmtree(temporary, ignore_errors=True)
        for folder in made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


def write_json(path: Path | str, obj) -> None:
    """Write ``obj`` as JSON in one step; numpy values become plain ones, NaN and infinities null."""
    path = Path(path)
    text = json.dumps(_plain(obj), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def require_out(out: Path | str) -> None:
    """BadInput where ``out`` cannot become a folder, because a file is in the way."""
    out = Path(os.path.abspath(out))
    if out.exists() and not out.is_dir():
        raise BadInput(out, "a folder to write into", "a file")
    with_file = next((folder for folder in out.parents if folder.exists()), None)
    if with_file is not None and not with_file.is_dir():
        raise BadInput(out, "a folder to write into", f"the file '{with_file}' in its path")


def _make_parents(out: Path) -> list[Path]:
    require_out(out)
    missing = [folder for folder in out.parents if not folder.exists()]
    out.parent.mkdir(parents=True, exist_ok=True)
    return missing


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
