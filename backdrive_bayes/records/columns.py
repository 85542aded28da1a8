"""Which column of a file holds time, torque or angle: as the unit file says, by default, or guessed and said."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.quantities import (
    BRACKETS,
    UNITS,
    WORDED,
    Quantity,
    canonical,
    is_named,
    parse_quantity,
    split_unit,
    suggestion,
)
from backdrive_bayes.records.readers import read_columns

DEFAULT_COLUMNS = {"time": "time_s", "torque": "torque_Nm", "angle": "angle_arcmin"}
_EXAMPLES = {"time": "s", "torque": "Nm", "angle": "deg"}
_SPELLED_OUT = {"Nm": "N·m", "mNm": "mN·m", "uNm": "µN·m", "kNm": "kN·m", "Ncm": "N·cm", "Nmm": "N·mm"}
_UNIT_FILE = "unit.toml"
_LARGEST = 1e60
"""No bench writes a larger number, and squares and products of larger ones overflow."""


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of a file in s, N·m and rad: arrays (samples,) by kind, the row of sample 0, notes, and their spelling there."""

    values: dict[str, np.ndarray]
    first_row: int
    notes: tuple[str, ...]
    spelling: dict[str, str]


def read_channels(path: Path, kinds, asked: dict[str, str]) -> Channels:
    """The channels of these ``kinds`` of a record file, under the names ``asked`` for or the default ones; raises BadInput."""
    found: dict[str, tuple[str, Quantity]] = {}

    def choose(headers: tuple[str, ...]) -> list[str]:
        lone = "angle" not in kinds
        found.update({kind: find_column(headers, kind, asked.get(kind), str(path), lone) for kind in kinds})
        chosen = [header for header, _ in found.values()]
        if len(set(chosen)) < len(chosen):
            raise BadInput(path, f"different columns for {' and '.join(kinds)}", ", ".join(chosen))
        return chosen

    columns = read_columns(path, choose)
    values = {}
    for column, (kind, (header, quantity)) in zip(columns.values, found.items(), strict=True):
        bad = np.flatnonzero(np.abs(column) > _LARGEST)
        if bad.size:
            where = f"{path}, row {columns.first_row + bad[0]}, column '{header}'"
            raise BadInput(where, f"a number below {_LARGEST:g}", f"{column[bad[0]]:.3g}")
        values[kind] = column * quantity.to_si
    notes = (*columns.notes, *(quantity.note for _, quantity in found.values() if quantity.note))
    return Channels(values, columns.first_row, notes, {kind: spelling(*chosen) for kind, chosen in found.items()})


def find_column(headers: tuple[str, ...], kind: str, asked: str | None, where: str, lone: bool = False) -> tuple[str, Quantity]:
    """Find the header that holds a quantity, and the unit in which it is written.

    ``asked`` is the unit file's spelling, or None for the default column (then any header called time, torque
    or angle with a known unit will do, and after that a common name or a lone unit that leaves no choice). Brackets may
    stand in the file, in ``asked``, or in both alike; a leading minus in ``asked`` turns the channel's sign. A
    ``lone`` file has no unit file to say it in.
    Raises BadInput for a missing or ambiguous column and for units that contradict each other.
    """
    if asked is None:
        return _default_column(headers, kind, where, lone)
    sign, name = _signed(asked)
    found = _matching(headers, name)
    if not found:
        raise BadInput(where, f"a {kind} column '{name}'", f"columns {_listed(headers)}")
    if len(found) > 1:
        raise BadInput(where, f"one {kind} column '{name}'", f"{len(found)}: {_listed(found)}")
    quantity = _agreed(found[0], name, kind, where)
    return found[0], replace(quantity, to_si=sign * quantity.to_si)


def spelling(header: str, quantity: Quantity) -> str:
    """What a unit file calls this column: its name with the unit in brackets, a minus in front where its sign is turned."""
    header = header.strip()
    named = header if BRACKETS.match(header) or header.endswith(f"_{quantity.unit}") else f"{header} [{quantity.unit}]"
    return f"-{named}" if quantity.to_si < 0.0 else named


def columns_to_paste(headers: tuple[str, ...]) -> str:
    """The columns of a unit file that would name this file's channels, ready to be pasted under [[record]]."""
    best = {kind: next(iter(_likely(headers, kind)), None) or _without_unit(headers, kind) for kind in UNITS}
    return "columns = {" + ", ".join(f"{kind} = {_quoted(name)}" for kind, name in best.items()) + "}"


def _without_unit(headers, kind) -> str:
    """A header that is called like the channel, or a place-holder, with a unit that its reader has to put right: as it stands it
    is refused, for a guess may be wrong a thousand times."""
    named = [h for h in headers if _bare(h) == kind or is_named(split_unit(h)[0], kind) or is_named(h, kind)]
    name = (split_unit(named[0])[0] if BRACKETS.match(named[0].strip()) else named[0].strip()) if named else "NAME"
    return f"{name[:200]} [{_EXAMPLES[kind]}?]"


def _default_column(headers, kind, where, lone) -> tuple[str, Quantity]:
    found = [h for h in headers if h == DEFAULT_COLUMNS[kind]] or [h for h in headers if _bare(h) == kind]
    plain = len(found) == 1 and _has_unit(found[0], kind) and not WORDED.match(found[0].strip())
    if plain or found == [DEFAULT_COLUMNS[kind]]:
        return found[0], parse_quantity(found[0], kind, where)
    guessed = found or _likely(headers, kind)
    advice = "" if lone else f"; say which in {_UNIT_FILE}, under [[record]]: {columns_to_paste(headers)}"
    if len(guessed) > 1:
        raise BadInput(where, f"one {kind} column '{DEFAULT_COLUMNS[kind]}'", f"{len(guessed)}: {_listed(guessed)}{advice}")
    if not guessed:
        raise BadInput(where, f"a {kind} column '{DEFAULT_COLUMNS[kind]}'", f"columns {_listed(headers)}{advice}")
    if not _has_known_unit(guessed[0], kind):
        units = f"a {kind} unit ({', '.join(UNITS[kind])}) as suffix, in brackets or after 'in'"
        raise BadInput(where, units, f"'{guessed[0]}'{suggestion(split_unit(guessed[0])[1], kind)}{advice}")
    quantity = parse_quantity(guessed[0], kind, where)
    note = f"read '{guessed[0]}' as {kind} in {_SPELLED_OUT.get(quantity.unit, quantity.unit)}"
    return guessed[0], replace(quantity, note=note)


def _likely(headers, kind) -> list[str]:
    """Headers that are called like the channel and have a unit of its kind, else those with such a unit in brackets."""
    named = [h for h in headers if _has_known_unit(h, kind) and is_named(split_unit(h)[0], kind)]
    return named or [h for h in headers if BRACKETS.match(h.strip()) and _has_known_unit(h, kind)]


def _has_known_unit(header: str, kind: str) -> bool:
    return canonical(split_unit(header)[1]) in UNITS[kind]


def _signed(asked: str) -> tuple[float, str]:
    text = asked.strip()
    return (-1.0, text[1:].strip()) if text[:1] in ("-", "\u2212") else (1.0, asked)


def _quoted(name: str) -> str:
    return "'" + name + "'" if '"' in name and "'" not in name else '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _agreed(header: str, asked: str, kind: str, where: str) -> Quantity:
    spelled = [text for text in (asked, header) if _has_unit(text, kind)]
    quantities = [parse_quantity(text, kind, where) for text in spelled or [asked]]
    if len({quantity.to_si for quantity in quantities}) > 1:
        raise BadInput(where, f"one unit for the {kind} column", f"'{asked}' asked for but '{header}' in the file")
    return quantities[0]


def _matching(headers, asked: str) -> list[str]:
    name = split_unit(asked)[0] if BRACKETS.match(asked.strip()) else asked.strip()
    for same in (
        lambda h: h == asked,
        lambda h: h.strip() == asked.strip(),
        lambda h: h.strip() == name,
        lambda h: bool(BRACKETS.match(h.strip())) and split_unit(h)[0] == name,
    ):
        found = [header for header in headers if same(header)]
        if found:
            return found
    return []


def _has_unit(spelling: str, kind: str) -> bool:
    return bool(BRACKETS.match(spelling.strip())) or canonical(split_unit(spelling)[1]) in UNITS[kind]


def _bare(header: str) -> str:
    return split_unit(header)[0].strip().casefold()


def _listed(names) -> str:
    shown = ", ".join(f"'{name if len(name) <= 60 else name[:59] + '…'}'" for name in names[:8]) or "none"
    return shown + (", …" if len(names) > 8 else "")
