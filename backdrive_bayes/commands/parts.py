"""Temporary names beside what is being written, and the taking away of those that a killed process left."""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

try:
    import fcntl
except ImportError:  # no POSIX: nothing tells a dead process's files from a living one's, and they stay
    fcntl = None  # type: ignore[assignment]

_OPEN: dict[Path, list[Path]] = {}
"""What this process is writing, and the folders that it made for that, innermost first."""


@contextlib.contextmanager
def part(path: Path) -> Iterator[Path]:
    """Yield a hidden name beside ``path`` that no other process uses; whatever stands there in the end is taken away.

    Missing folders above ``path`` are made, and go again where nothing came of it. A lock beside the name, which the system
    gives up with the process, says that its writer lives; what has no such lock is taken away first.
    """
    made = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    _sweep(path)
    token = secrets.token_hex(4)
    temporary, lock = path.parent / f"{_stem(path)}{token}.part", path.parent / f"{_stem(path)}{token}.lock.part"
    held = _locked(lock)
    _OPEN[temporary], _OPEN[lock] = made, []
    try:
        yield temporary
    finally:
        for name in (lock, temporary):
            _take_away(name, _OPEN.pop(name))
        if held is not None:
            os.close(held)


def take_away_open() -> None:
    """Take away everything that this process is writing."""
    for path, made in reversed(tuple(_OPEN.items())):
        _take_away(path, made)


def _take_away(path: Path, made: list[Path]) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    with contextlib.suppress(OSError):
        path.unlink()
    with contextlib.suppress(OSError):  # what holds something stays
        for folder in made:
            folder.rmdir()


def _stem(path: Path) -> str:
    return f".{path.name[:80]}."


def _sweep(path: Path) -> None:
    """Take away what writers of ``path`` left that live no more."""
    if fcntl is None:
        return
    stem = _stem(path)
    left = [p.name[len(stem) :] for p in path.parent.iterdir() if p.name.startswith(stem) and p.name.endswith(".part")]
    for token in {name.partition(".")[0] for name in left}:
        lock = path.parent / f"{stem}{token}.lock.part"
        held = _locked(lock)
        if held is not None:
            _take_away(path.parent / f"{stem}{token}.part", [])
            _take_away(lock, [])
            os.close(held)


def _locked(lock: Path) -> int | None:
    """A descriptor that holds the lock, None where another process does or the file system knows no locks."""
    if fcntl is None:
        return None
    handle = os.open(lock, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        return None
    return handle
