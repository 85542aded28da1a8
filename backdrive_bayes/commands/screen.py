"""Tables on the screen, drawn by rich: they fit 80 columns, and lose colours and frames where a stream shows none."""

from __future__ import annotations

import io
import shutil
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from backdrive_bayes.commands.output import in_encoding_of, say

WIDEST, UNASKED = 140, 120
"""Columns up to which a table grows (beyond, the eye loses its row), and those where no terminal tells any."""
NARROWEST, SEPARATOR = 12, 3
"""Characters of a column of words at least, and between two columns at most."""
UNBOUNDED = 100_000
"""A width that no table reaches."""
_SPELT = {"δ": "delta", "θ": "theta", "′": "arcmin", "·": " ", "±": "+/-", "µ": "u", "≤": "<=", "≥": ">=", "≈": "~"}
_PLAIN = str.maketrans(_SPELT | {"−": "-", "–": "-"})
"""Signs of the tables where a stream cannot write them."""


@dataclass(frozen=True)
class Column:
    """A column's heading, whether its cells are numbers, and the fewest characters it may be squeezed to."""

    heading: str
    number: bool = True
    least: int = 0


def show_table(columns: Sequence[Column], rows: Iterable[Sequence[str]], title: str = "", note: str = "") -> None:
    """Write a table; a cell may hold several lines. Nothing in a cell is obeyed as markup or as a control character."""
    from rich.box import ASCII2, SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    plain = not _encodes("─≤δ")
    table = Table(box=ASCII2 if plain else SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    for column in columns:
        table.add_column(
            Text(_safe(column.heading)), justify="right" if column.number else "left", no_wrap=column.number,
            overflow="fold", min_width=column.least or None,
        )  # fmt: skip
    cells = [[_safe(cell) for cell in row] for row in rows]
    for row in cells:
        table.add_row(*(Text(cell, style=_STYLES.get(cell, "")) for cell in row))
    drawn, terminal = io.StringIO(), sys.stdout.isatty()
    console = Console(file=drawn, width=UNBOUNDED, force_terminal=terminal, highlight=False)
    # A column that does not fit would be left out without a word.
    console.print(table, width=max(width(), _least_width(columns, cells)), crop=False, no_wrap=True)
    lines = [line.rstrip() for line in drawn.getvalue().split("\n") if line.strip()]
    say()
    if title:
        say(_safe(title))
    if terminal:  # colours; every cell is made safe already
        sys.stdout.write("\n".join([*lines, ""]))
    else:
        for line in lines:
            say(line)
    if note:
        say(_safe(note))


def width() -> int:
    """Characters of a line: those of the terminal, up to a bound."""
    return min(shutil.get_terminal_size((UNASKED, 24)).columns, WIDEST)


def _least_width(columns: Sequence[Column], cells: Sequence[Sequence[str]]) -> int:
    """Characters that a table needs: whole numbers, and words as narrow as their columns may be."""
    widest = [max(len(line) for text in texts for line in text.split("\n")) for texts in _texts(columns, cells)]
    needed = [w if c.number else min(w, max(c.least, NARROWEST)) for c, w in zip(columns, widest, strict=True)]
    return sum(needed) + SEPARATOR * (len(columns) - 1)


def _texts(columns, cells):
    return zip((c.heading for c in columns), *cells, strict=True)


_STYLES = {"accepted": "green", "rejected": "red", "inconclusive": "yellow", "holds": "green", "does not hold": "red"}


def _encodes(text: str) -> bool:
    return in_encoding_of(sys.stdout, text) == text


def _safe(text: str) -> str:
    return in_encoding_of(sys.stdout, text if _encodes(text) else text.translate(_PLAIN))
