"""Headers that are no defaults of ours: common names in several languages, recognised by name and unit together."""

from __future__ import annotations

import re

NAMES = {
    "time": "time t zeit zeitstempel messzeit timestamp elapsed temps tiempo tempo tijd čas 时间 時間 时刻",
    "torque": "torque drehmoment moment m md mz m_out m_ab abtriebsmoment lastmoment couple par momento coppia koppel tau τ "
    "load output_torque torque_out load_torque 扭矩 转矩 力矩 トルク",
    "angle": "angle winkel drehwinkel verdrehwinkel abtriebswinkel verdrehung phi φ ϕ theta θ rotation encoder position "
    "angolo angulo ángulo hoek angle_de_rotation output_angle angle_out twist 角度 转角 回転角",
}
_KNOWN = {kind: frozenset(words.split()) for kind, words in NAMES.items()}


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
