"""The fonts of figures and reports, and which characters they can show."""

from __future__ import annotations

import unicodedata
from functools import cache
from pathlib import Path

from backdrive_bayes.figures.style import matplotlib, shortened

_INVISIBLE = {"Cc", "Cf", "Cs", "Co", "Cn"}


def font_folder() -> Path:
    """The folder with the fonts that matplotlib brings along."""
    return Path(matplotlib.get_data_path()) / "fonts" / "ttf"


@cache
def characters(font_file: Path) -> frozenset[int]:
    """Code points that a font file can show; none where it cannot be read."""
    from matplotlib.ft2font import FT2Font

    try:
        return frozenset(FT2Font(str(font_file)).get_charmap())
    except (RuntimeError, OSError):
        return frozenset()


def uncovered(text: str, font_files=()) -> set[str]:
    """Characters of ``text`` that neither the own font nor any of ``font_files`` can show."""
    missing = {c for c in text if ord(c) not in characters(font_folder() / "DejaVuSans.ttf")}
    for file in font_files:
        if not missing:
            break
        missing = {c for c in missing if ord(c) not in characters(Path(file))}
    return missing


def drawable(text, longest: int) -> str:
    """Somebody else's text in one line of at most ``longest`` characters; what the font lacks is spelt out."""
    text = " ".join(str(text).split())
    missing = uncovered(text)
    bad = {c for c in text if c in missing or unicodedata.category(c) in _INVISIBLE}
    text = "".join(f"\\u{{{ord(c):X}}}" if c in bad else c for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"


def drawn_names(names, most: int = 24) -> dict[str, str]:
    """Units' names, shortened, for a figure, those that come out alike numbered: what begins with an underscore would be left out
    of legends, and what no font holds takes many letters."""
    short = {}
    for name in names:
        tried = (drawable(shortened(name, length), 9 * most) for length in range(most, 0, -1))
        text = next((t for t in tried if len(t) <= most + most // 3), "…")
        short[name] = f" {text}" if text.startswith("_") else text
    alike = list(short.values())
    return {n: t if alike.count(t) == 1 else f"{t} ({alike[: i + 1].count(t)})" for i, (n, t) in enumerate(short.items())}
