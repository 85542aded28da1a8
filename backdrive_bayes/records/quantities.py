"""Column names of a bench: which quantity they hold and in which unit; names common in several languages are known."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass

from backdrive_bayes.errors import BadInput

_DEG = math.radians(1.0)
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
        "rev": math.tau,
    },
}
BRACKETS = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\))\s*$")
WORDED = re.compile(r"^(?P<name>\S.*?)(?:\s+in\s+|\s+/\s+|\s*,\s+)(?P<unit>\S+(?:\s\S+)?)$")
"""A unit after "in", a slash between blanks or a comma: "Moment in mNm", "M / N m". A bare slash parts groups from channels."""
_SPELLED_ALIKE = str.maketrans({"µ": "u", "μ": "u", "′": "'", "’": "'", "″": '"', "”": '"', "º": "°"})
_NAMES = {
    "time": "time t zeit zeitstempel messzeit timestamp elapsed temps tiempo tempo tijd čas 时间 時間 时刻",
    "torque": "torque drehmoment moment m md mz m_out m_ab abtriebsmoment lastmoment couple par momento coppia koppel tau τ "
    "load output_torque torque_out load_torque 扭矩 转矩 力矩 トルク",
    "angle": "angle winkel drehwinkel verdrehwinkel abtriebswinkel verdrehung phi φ ϕ theta θ rotation encoder position "
    "angolo angulo ángulo hoek angle_de_rotation output_angle angle_out twist 角度 转角 回転角",
}
_MEANT = {"grad": "deg", "degree": "deg", "degrees": "deg", "radian": "rad", "radians": "rad"}
_KNOWN = {kind: frozenset(words.split()) for kind, words in _NAMES.items()}


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
    factor = UNITS[kind].get(canonical(unit)) if unit else None
    if factor is None:
        known = f"a {kind} unit ({', '.join(UNITS[kind])}) as suffix, in brackets or after 'in'"
        raise BadInput(where, known, f"'{spelling}'{suggestion(unit, kind)}")
    return Quantity(name, canonical(unit), factor)


def split_unit(spelling: str) -> tuple[str, str]:
    """Split a spelling into name and unit text; the unit is empty where there is none."""
    spelling = spelling.strip()
    match = BRACKETS.match(spelling)
    if match:
        return match["name"].strip(), (match["square"] or match["round"] or "").strip()
    match = WORDED.match(spelling)
    if match and is_unit(match["unit"]):
        return match["name"], match["unit"]
    name, _, unit = spelling.rpartition("_")
    return (name, unit) if name else (spelling, "")


def is_unit(text: str) -> bool:
    """Whether a text is a unit of time, torque or angle."""
    return any(canonical(text) in units for units in UNITS.values())


def labelled(name: str, unit: str | None) -> str:
    """A channel's name with its unit in brackets, unless the name brings a unit of its own or there is none."""
    if not unit or BRACKETS.match(name) or is_unit(split_unit(name)[1]):
        return name
    return f"{name} [{unit.strip()}]"


def canonical(unit: str) -> str:
    """A unit's one spelling: dots and blanks between newton and metre left out, signs that look alike made one."""
    unit = re.sub(r"(?<=N)[\s.·⋅*∙•]+(?=c?m)", "", unit.strip().translate(_SPELLED_ALIKE))
    return unit.replace("arc min", "arcmin").replace("arc sec", "arcsec")


def suggestion(unit: str, kind: str) -> str:
    """A question whether a near unit was meant, empty where none is near."""
    near = [known for known in UNITS[kind] if known.casefold() == unit.casefold()]
    meant = _MEANT.get(unit.casefold())
    near = near or ([meant] if meant in UNITS[kind] else [])
    near = near or difflib.get_close_matches(unit, UNITS[kind], n=1)
    return f" (did you mean {near[0]}?)" if unit and near else ""


def is_named(name: str, kind: str) -> bool:
    """Whether a header's plain name is a common one of that kind of channel; groups before a slash do not count."""
    last = name.strip().rpartition("/")[2].strip()
    folded = re.sub(r"[\s.\-]+", "_", last.casefold()).strip("_")
    known = _KNOWN[kind]
    if folded in known:
        return True
    # "Drehmoment Abtrieb", "Winkel 1": the first word of several decides where it is a long one.
    first = folded.split("_")[0]
    return len(first) > 3 and first in known
