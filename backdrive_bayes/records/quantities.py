"""Column names of a bench: which quantity they hold and in which unit."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass

from backdrive_bayes.errors import BadInput

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
_BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$")
_SPELLED_ALIKE = str.maketrans({"µ": "u", "μ": "u", "′": "'", "’": "'", "″": '"', "”": '"', "º": "°"})


@dataclass(frozen=True)
class Quantity:
    """A column's plain name and its unit; ``to_si`` multiplies a value into s, N·m or rad."""

    name: str
    unit: str
    to_si: float


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


def find_column(headers: tuple[str, ...], kind: str, asked: str | None, where: str) -> tuple[str, Quantity]:
    """Find the header that holds a quantity, and the unit in which it is written.

    ``asked`` is the unit file's spelling, or None for the default column (then any header called time, torque
    or angle with a known unit will do). Brackets may stand in the file, in ``asked``, or in both alike.
    Raises BadInput for a missing or ambiguous column and for units that contradict each other.
    """
    if asked is None:
        found = [h for h in headers if h == DEFAULT_COLUMNS[kind]] or [h for h in headers if _bare(h) == kind]
        asked = found[0] if found else DEFAULT_COLUMNS[kind]
    else:
        found = _matching(headers, asked)
    if not found:
        raise BadInput(where, f"a {kind} column '{asked}'", f"columns {_listed(headers)}")
    if len(found) > 1:
        raise BadInput(where, f"one {kind} column '{asked}'", f"{len(found)}: {_listed(found)}")
    return found[0], _agreed(found[0], asked, kind, where)


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
    shown = ", ".join(f"'{name}'" for name in names[:8]) or "none"
    return shown + (", …" if len(names) > 8 else "")
