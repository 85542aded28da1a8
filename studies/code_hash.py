"""A fingerprint of the code behind a result, so that results of different code are not mixed."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

import backdrive_bayes


@functools.cache
def code_hash(rooms: tuple[str, ...], but: tuple[str, ...] = ()) -> str:
    """Hash of the package's rooms, without the files of the given names."""
    package = Path(backdrive_bayes.__file__).parent
    files = sorted(p for room in rooms for p in (package / room).rglob("*.py"))
    return hashlib.sha256(b"".join(p.read_bytes() for p in files if p.name not in but)).hexdigest()[:12]
