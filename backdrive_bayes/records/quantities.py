"""Column names of a bench: which quantity they hold and in which unit."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, replace

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.header_names import is_named

_TURN = 2.0 * math.pi
_DEG = math.pi / 180.0
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "torque": {"Nm": 1.0, "mNm": 1e-3, "uNm": 1e-6, "kNm": 1e3, "Ncm": 1e-2, "Nmm": 1e-3},
    "angle": {
        "rad": 1.0,
        "mrad": 1e-3,
        "urad": 1e-6,
        "deg": _DEG,
        "°": _DEG,
        "arcmin": _DEG / 60.0,
        "'": _DEG / 60.0,
        "arcsec": _DEG / 3600.0,
        '"': _DEG / 3600.0,
        "rev": _TURN,
    },
}
DEFAULT_COLUMNS = {"time": "time_s", "torque": "torque_Nm", "angle": "angle_arcmin"}
_EXAMPLES = {"time": "s", "torque": "Nm", "angle": "deg"}
_SPELLED_OUT = {"Nm": "N·m", "mNm": "mN·m", "uNm": "µN·m", "kNm": "kN·m", "Ncm": "N·cm", "Nmm": "N·mm"}
_UNIT_FILE = "unit.toml"
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$")
_SPELLED_ALIKE = str.maketrans({"µ": "u", "μ": "u", "′": "'", "’": "'", "″": '"', "”": '"', "º": "°"})


@dataclass(frozen=True)
class Quantity:
    """A column's plain name and its unit; ``to_si`` multiplies a value into s, N·m or rad, negative where its sign is turned.

    ``note`` says so where the column was guessed.
    """

    name: str
    unit: str
    to_si: float
    note: str = ""


def parse_quantity(spelling: str, kind: str, where: str) -> Quantity:
    """Read the name and unit of a ``kind`` ('time', 'torque' or 'angle') column from its spelling.

    ``torque_mNm``, ``M [mN·m]`` and ``M (mNm)`` all work. Raises BadInput at ``where`` when the unit is
    missing or does not belong to the kind.
    """
    name, unit = split_unit(spelling)
    factor = UNITS[kind].get(_canonical(unit)) if unit else None
    if factor is None:
        raise BadInput(
            where,
            f"a {kind} unit ({', '.join(UNITS[kind])}) as suffix or in brackets",
            f"'{spelling}'{_suggestion(unit, kind)}",
        )
    return Quantity(name, _canonical(unit), factor)


def split_unit(spelling: str) -> tuple[str, str]:
    """Split a spelling into name and unit text; the unit is empty where there is none."""
    spelling = spelling.strip()
    match = _BRACKETS.match(spelling)
    if match:
        return match["name"].strip(), (match["square"] or match["round"] or "").strip()
    name, _, unit = spelling.rpartition("_")
    return (name, unit) if name else (spelling, "")


def is_unit(text: str) -> bool:
    """Whether a text is a unit of time, torque or angle."""
    return any(_canonical(text) in units for units in UNITS.values())


def labelled(name: str, unit: str | None) -> str:
    """A channel's name with its unit in brackets, unless the name brings a unit of its own or there is none."""
    if not unit or _BRACKETS.match(name) or is_unit(split_unit(name)[1]):
        return name
    return f"{name} [{unit.strip()}]"


def find_column(headers: tuple[str, ...], kind: str, asked: str | None, where: str) -> tuple[str, Quantity]:
    """Find the header that holds a quantity, and the unit in which it is written.

    ``asked`` is the unit file's spelling, or None for the default column (then any header called time, torque
    or angle with a known unit will do, and after that a common name or a lone unit that leaves no choice). Brackets may
    stand in the file, in ``asked``, or in both alike; a leading minus in ``asked`` turns the channel's sign.
    Raises BadInput for a missing or ambiguous column and for units that contradict each other.
    """
    if asked is None:
        return _default_column(headers, kind, where)
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
    named = header if _BRACKETS.match(header) or header.endswith(f"_{quantity.unit}") else f"{header} [{quantity.unit}]"
    return f"-{named}" if quantity.to_si < 0.0 else named


def columns_to_paste(headers: tuple[str, ...]) -> str:
    """The columns of a unit file that would name this file's channels, ready to be pasted under [[record]]."""
    best = {kind: next(iter(_likely(headers, kind)), None) or _without_unit(headers, kind) for kind in UNITS}
    return "columns = {" + ", ".join(f"{kind} = {_quoted(name)}" for kind, name in best.items()) + "}"


def _without_unit(headers, kind) -> str:
    """A header that is called like the channel, or a place-holder, with a unit that its reader has to put right."""
    named = [h for h in headers if _bare(h) == kind or is_named(split_unit(h)[0], kind) or is_named(h, kind)]
    return f"{named[0].strip()[:200] if named else 'NAME'} [{_EXAMPLES[kind]}]"


def _default_column(headers, kind, where) -> tuple[str, Quantity]:
    found = [h for h in headers if h == DEFAULT_COLUMNS[kind]] or [h for h in headers if _bare(h) == kind]
    if len(found) == 1 and (found[0] == DEFAULT_COLUMNS[kind] or _has_unit(found[0], kind)):
        return found[0], parse_quantity(found[0], kind, where)
    guessed = found or _likely(headers, kind)
    advice = f"; say which in {_UNIT_FILE}, under [[record]]: {columns_to_paste(headers)}"
    if len(guessed) > 1:
        raise BadInput(where, f"one {kind} column '{DEFAULT_COLUMNS[kind]}'", f"{len(guessed)}: {_listed(guessed)}{advice}")
    if not guessed:
        raise BadInput(where, f"a {kind} column '{DEFAULT_COLUMNS[kind]}'", f"columns {_listed(headers)}{advice}")
    if not _has_known_unit(guessed[0], kind):
        units = f"a {kind} unit ({', '.join(UNITS[kind])}) as suffix or in brackets"
        raise BadInput(where, units, f"'{guessed[0]}'{_suggestion(split_unit(guessed[0])[1], kind)}{advice}")
    quantity = parse_quantity(guessed[0], kind, where)
    note = f"read '{guessed[0]}' as {kind} in {_SPELLED_OUT.get(quantity.unit, quantity.unit)}"
    return guessed[0], replace(quantity, note=note)


def _likely(headers, kind) -> list[str]:
    """Headers that are called like the channel and have a unit of its kind, else those with such a unit in brackets."""
    named = [h for h in headers if _has_known_unit(h, kind) and is_named(split_unit(h)[0], kind)]
    return named or [h for h in headers if _BRACKETS.match(h.strip()) and _has_known_unit(h, kind)]


def _has_known_unit(header: str, kind: str) -> bool:
    return _canonical(split_unit(header)[1]) in UNITS[kind]


def _signed(asked: str) -> tuple[float, str]:
    text = asked.strip()
    return (-1.0, text[1:].strip()) if text[:1] in ("-", "\u2212") else (1.0, asked)


def _quoted(name: str) -> str:
    return "'" + name + "'" if '"' in name and "'" not in name else '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _agreed(header: str, asked: str, kind: str, where: str) -> Quantity:
    spelled = [text for text in (asked, header) if _has_unit(text, kind)]
    quantities = [parse_quantity(text, kind, where) for text in spelled or [asked]]
    if len({quantity.to_si for quantity in quantities}) > 1:
        raise BadInput(
            where, f"one unit for the {kind} column", f"'{asked}' asked for but '{header}' in the file"
        )
    return quantities[0]


def _matching(headers, asked: str) -> list[str]:
    name = split_unit(asked)[0] if _BRACKETS.match(asked.strip()) else asked.strip()
    for same in (
        lambda h: h == asked,
        lambda h: h.strip() == asked.strip(),
        lambda h: h.strip() == name,
        lambda h: bool(_BRACKETS.match(h.strip())) and split_unit(h)[0] == name,
    ):
        found = [header for header in headers if same(header)]
        if found:
            return found
    return []


def _has_unit(spelling: str, kind: str) -> bool:
    return bool(_BRACKETS.match(spelling.strip())) or _canonical(split_unit(spelling)[1]) in UNITS[kind]


def _bare(header: str) -> str:
    return split_unit(header)[0].strip().casefold()


def _canonical(unit: str) -> str:
    unit = re.sub(r"(?<=N)[\s.·⋅*∙•]+(?=c?m)", "", unit.strip().translate(_SPELLED_ALIKE))
    return unit.replace("arc min", "arcmin").replace("arc sec", "arcsec")


def _suggestion(unit: str, kind: str) -> str:
    near = [known for known in UNITS[kind] if known.casefold() == unit.casefold()]
    near = near or difflib.get_close_matches(unit, UNITS[kind], n=1)
    return f" (did you mean {near[0]}?)" if unit and near else ""


def _listed(names) -> str:
    shown = ", ".join(f"'{name if len(name) <= 60 else name[:59] + '…'}'" for name in names[:8]) or "none"
    return shown + (", …" if len(names) > 8 else "")
