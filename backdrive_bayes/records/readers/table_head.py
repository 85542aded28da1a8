"""Where the names of a table stand: behind a preamble perhaps, with a row of units below them perhaps."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from backdrive_bayes.records.quantities import is_unit, labelled

MOST_HEAD_ROWS = 400
_OTHER_UNITS = frozenset("- 1 v mv a ma n kn mm m um hz khz k °c c % rpm 1/min bar w count counts".split())
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class TableHead:
    """Names of a table's columns, and the row (counted from 0) of its first sample."""

    names: tuple[str, ...]
    first_row: int
    notes: tuple[str, ...] = ()


def find_head(rows: Sequence[Sequence[str]], is_number: Callable[[str], bool] | None = None) -> TableHead | None:
    """The head of a table of text cells, None where no row of names stands above a row of numbers."""
    is_number = is_number or (lambda cell: bool(_NUMBER.fullmatch(cell.strip())))
    kinds = [_kind(row, is_number) for row in rows[:MOST_HEAD_ROWS]]
    filled = [i for i, kind in enumerate(kinds) if kind]
    for at, (name, first) in enumerate(zip(filled, filled[1:], strict=False)):
        if (kinds[name], kinds[first]) != ("names", "numbers") or first > name + 2:
            continue
        above = filled[at - 1] if at else None
        if above is not None and kinds[above] == "names" and _are_units(rows[name]):
            return TableHead(_with_units(rows[above], rows[name]), first, (*_skipped(filled[: at - 1]), "read units from a row"))
        return TableHead(tuple(cell.strip() for cell in rows[name]), first, _skipped(filled[:at]))
    return None


def _kind(row: Sequence[str], is_number) -> str:
    cells = [cell for cell in row if cell.strip()]
    numbers = sum(is_number(cell) for cell in cells)
    if numbers >= 2:
        return "numbers"
    return "names" if len(cells) >= 2 and not numbers else "text" if cells else ""


def _are_units(row: Sequence[str]) -> bool:
    cells = [_bare(cell) for cell in row if cell.strip()]
    known = [is_unit(cell) for cell in cells]
    return sum(known) >= 2 and all(k or cell.casefold() in _OTHER_UNITS for k, cell in zip(known, cells, strict=True))


def _bare(cell: str) -> str:
    return cell.strip().strip("[]()").strip()


def _with_units(names: Sequence[str], units: Sequence[str]) -> tuple[str, ...]:
    units = [_bare(unit) for unit in units] + [""] * len(names)
    return tuple(labelled(name.strip(), unit) for name, unit in zip(names, units, strict=False))


def _skipped(above: list[int]) -> tuple[str, ...]:
    count = len(above)
    return (f"{count} line{'s'[: count != 1]} above the header left out",) if count else ()
