"""The fonts of figures and reports, and which characters they can show."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from backdrive_bayes.figures.style import matplotlib


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
