"""Free text made safe to print: what cannot be shown is spelt out, long words are made breakable."""

from __future__ import annotations

import re
import unicodedata

LONGEST = 240
DIGITS = 12
UNBREAKABLE, PIECE = 16, 12
"""Letters from which on a word may be broken, and of a piece of it at most: so many have room in the narrowest column."""
BREAK = "\u200b"
LOW, END = "\ue000", "\ue001"
"""Marks around an index; free text cannot hold them, because :func:`printable` spells them out."""
_SYMBOLS = re.compile(r"(?<![A-Za-z_'\"])(k?[WSTθτ]|p)_(abs|g|f|r|L|c)(?![A-Za-z_])")
_DIGEST = re.compile(r"[0-9a-f]{64}")
_INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn"}


def printable(text: str, missing: frozenset[str] = frozenset()) -> str:
    r"""``text`` in one line with invisible characters and those in ``missing`` spelt out as ``\u{…}``."""
    text = " ".join(str(text).split())
    text = "".join(_spelt(c) if unicodedata.category(c) in _INVISIBLE or c in missing else c for c in text)
    return re.sub(rf"\S{{{UNBREAKABLE},}}", _breakable, text)


class Free(str):
    """Text that somebody else wrote: printed letter by letter, never typeset."""


class Address(str):
    """A file's name, which stays as it is."""


def free(text, longest: int = LONGEST) -> Free:
    """``text`` marked as free text and cut to at most ``longest`` characters."""
    return Free(cut(text, longest))


def cut(text, longest: int) -> str:
    """``text`` in one line of at most ``longest`` characters, ended after a whole word where one ends in its later half."""
    text = " ".join(str(text).split())
    if len(text) <= longest:
        return text
    head, space, _ = text[:longest].rpartition(" ")
    return (head.rstrip(" ,;:–-") if space and len(head) > longest // 2 else text[: longest - 1]) + "…"


def digests(hashes) -> str:
    """One SHA-256, or several of them, short."""
    return ", ".join(short_digest(str(h)) for h in ([hashes] if isinstance(hashes, str) else hashes))


def short_digest(digest: str) -> str:
    """The first digits of a digest, enough to recognise it; the whole stands under "Reproduction"."""
    return digest if len(digest) <= DIGITS else digest[:DIGITS] + "…"


def typeset(text: str) -> str:
    """Our own text with the indices of its symbols between the marks that the template sets low."""
    return _SYMBOLS.sub(f"\\1{LOW}\\2{END}", text)


def _spelt(character):
    return f"\\u{{{ord(character):X}}}"


def _breakable(found):
    word = found[0]
    # A digest fits its line, and a break inside it would be copied along with it.
    if _DIGEST.fullmatch(word.rstrip(".,;")):
        return word
    pieces = re.split(r"(?<=[(),;=/}])|(?<=\.)(?=\D)", word)
    pieces = [p for piece in pieces for p in (re.split(r"(?<=[-_])", piece) if len(piece) > PIECE else [piece])]
    return BREAK.join(p[i : i + PIECE] for p in pieces for i in range(0, len(p), PIECE))


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
