"""Free text made safe to print: what cannot be shown is spelt out, long words are made breakable."""

from __future__ import annotations

import re
import unicodedata

LONGEST = 240
UNBREAKABLE = 36
BREAK = "\u200b"
LOW, END = "\ue000", "\ue001"
"""Marks around an index; free text cannot hold them, because :func:`printable` spells them out."""
_SYMBOLS = re.compile(r"(?<![A-Za-z])(k?[WSTθτ]|p)_(abs|g|f|r|L|c)(?![A-Za-z])")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn"}


def printable(text: str, missing: frozenset[str] = frozenset()) -> str:
    r"""``text`` in one line with invisible characters and those in ``missing`` spelt out as ``\u{…}``."""
    text = " ".join(str(text).split())
    text = "".join(_spelt(c) if unicodedata.category(c) in _INVISIBLE or c in missing else c for c in text)
    return re.sub(rf"\S{{{UNBREAKABLE},}}", _breakable, text)


class Free(str):
    """Text that somebody else wrote: printed letter by letter, never typeset."""


def free(text, longest: int = LONGEST) -> Free:
    """``text`` marked as free text and cut to at most ``longest`` characters."""
    text = " ".join(str(text).split())
    return Free(text if len(text) <= longest else text[: longest - 1] + "…")


def typeset(text: str) -> str:
    """Our own text with the indices of its symbols between the marks that the template sets low."""
    return _SYMBOLS.sub(f"\\1{LOW}\\2{END}", text)


def _spelt(character):
    return f"\\u{{{ord(character):X}}}"


def _breakable(found):
    word, step = found[0], UNBREAKABLE // 2
    # A digest fits its line, and a break inside it would be copied along with it.
    return (
        word if _DIGEST.fullmatch(word) else BREAK.join(word[i : i + step] for i in range(0, len(word), step))
    )


def every_string(data) -> list[str]:
    """All strings inside nested lists and dicts."""
    if isinstance(data, str):
        return [data]
    if isinstance(data, dict):
        return [s for v in data.values() for s in every_string(v)]
    if isinstance(data, list | tuple):
        return [s for v in data for s in every_string(v)]
    return []


def map_strings(function, data):
    """The same nested data with ``function`` applied to every string."""
    if isinstance(data, str):
        return function(data)
    if isinstance(data, dict):
        return {k: map_strings(function, v) for k, v in data.items()}
    if isinstance(data, list | tuple):
        return [map_strings(function, v) for v in data]
    return data
