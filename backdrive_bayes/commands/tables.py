"""What verbs show of results: one row a record, a limit, a condition, an effect or a claim, numbers with their intervals."""

from __future__ import annotations

import math
import re

from backdrive_bayes.commands.output import say
from backdrive_bayes.commands.screen import Column, show_table, width
from backdrive_bayes.figures.style import words
from backdrive_bayes.number_text import (
    ARCMIN_PER_RAD,
    interval_text,
    level_text,
    like_interval,
    marked,
    plain,
    probability_text,
    share_text,
)
from backdrive_bayes.results import usable

ONE_LINE = 110
"""Columns from which an interval stands beside its median; below it stands under it."""
LEAST_SHOWN = 0.005
"""Probability below which an effect is not worth a row."""
_SYMBOLS = {
    "lost_motion_rad": "δ",
    "zero_torque_width_rad": "w(0)",
    "peak_angle_rad": "peak",
    "loop_area_J": "S",
    "absorbed_J": "W_abs",
    "dissipation_ratio": "u",
}
_SHOWN = ("lost_motion_rad", "zero_torque_width_rad", "loop_area_J", "dissipation_ratio")
SPLIT = {
    "closed_by_retuning": "closed by re-tuning",
    "closed_by_effect": "closed by what is missing",
    "left": "left",
}
"""Parts of the gap between a simulator and a unit."""
_SUFFIX = re.compile(r"\.(csv|xlsx|parquet|tdms|mat|mf4)(\.[gx]z)?$")
_AT = "rate [N·m/s],\namplitude [N·m]"
_CONTRASTS = {"greater": ">", "less": "<", "equivalent": "≈", "undecided": "?", "inconclusive": "–"}


def show_indicators(result: dict) -> None:
    """δ, w(0), S and u of an indicators object, a row a record; of one that has not converged every number is marked."""
    provisional = not usable(result)
    areas = [abs(r["indicators"]["loop_area_J"]["median"]) for r in result["records"]]
    energy, per_joule = _in_prefix("J", max(areas))
    scales = (ARCMIN_PER_RAD, ARCMIN_PER_RAD, per_joule, 1.0)
    headings = ("δ [′]", "w(0) [′]", f"S [{energy}]", "u")
    rows = [
        [_record(record), *(_cell(record["indicators"][n], f, provisional) for n, f in zip(_SHOWN, scales, strict=True))]
        for record in result["records"]
    ]
    title = f"Median [{level_text(result['level'])} interval], lost motion δ at ±{result['k']:g} T_r"
    note = "? provisional: not to be used" if provisional else ""
    show_table([Column(f"record\n{_AT}", False, 16), *map(Column, headings)], rows, title, note)
    lacking = [r["file"] for r in result["records"] if r["indicators"]["lost_motion_rad"] is None]
    if lacking:
        say(f"δ is not defined where the loop is smaller than ±{result['k']:g} T_r: {', '.join(lacking)}")


def show_loads(result: dict) -> None:
    """θ_L and W_L of the loads that were asked for."""
    rows = [
        [
            f"{row['load_Nm']:.4g} N·m", f"{row['loading_rate_Nm_per_s']:.3g}", _cell(row["theta_L_rad"], ARCMIN_PER_RAD),
            _cell(row["W_L_J"], 1e3), " and ".join(row["predicted"]).replace("_", " "),
        ]
        for row in result.get("loads", [])
    ]  # fmt: skip
    if rows:
        columns = [Column("load"), Column("rate [N·m/s]"), Column("θ_L [′]"), Column("W_L [mJ]"), Column("not measured", False)]
        show_table(columns, rows)


def show_limits(verdict: dict) -> None:
    """Every limit with its posterior and the probability that it is kept."""
    rows = []
    for row in verdict["limits"]:
        limit, factor = _limit(row)
        kept = probability_text(row["conformance_probability"])
        rows.append([limit, _condition(row), _cell(row, factor), kept, row["verdict"]])
    interval = Column("median [interval]")
    show_table([Column("limit", False), Column(_AT, False), interval, Column("P(kept)"), Column("verdict", False)], rows)
    if unheld := verdict["structure"]["unknown_probability"]:
        say(f"P(kept) counts as not kept what no model at hand holds: probability {probability_text(unheld)}")
    for row in verdict["limits"]:
        if found := row["global"]:
            risks = f"consumer's {probability_text(found['consumer'])}, producer's {probability_text(found['producer'])}"
            say(f"global risks of the limit on {_symbol(row['indicator'])}: {risks}")


def show_pair(pair: dict, level: float) -> None:
    """Ratios of two units' indicators, a row a common condition; each with the sign that they bear."""
    rows = [
        [_condition(condition), *(_ratio(condition["indicators"].get(name)) for name in _SHOWN)]
        for condition in pair["conditions"]
    ]
    title = f"{pair['first']} / {pair['second']}: ratio [{level_text(level)} interval]"
    note = f"> larger, < smaller, ≈ equivalent, ? undecided: {pair['first']} against {pair['second']}"
    show_table([Column(_AT, False), *(Column(_symbol(n)) for n in _SHOWN)], rows, title, note)
    for refused in pair["refused"]:
        say(f"not compared: {refused['unit']} at {refused['record']}: {refused['reason']}")


def show_claims(claims: list[dict]) -> None:
    """Claims with their answers."""
    rows = [
        [claim["id"], f"{claim['claim']}\n{claim['reason']}".strip(), probability_text(claim["probability"]), claim["verdict"]]
        for claim in claims
    ]
    show_table([Column("no."), Column("claim", False, 24), Column("P"), Column("answer", False)], rows)


def show_which(result: dict) -> None:
    """The likeliest effects of a diagnosis."""
    chosen = result["answer"]["credible_set_90"]
    rows = [
        [row["effect"].replace("_", " "), probability_text(row["probability"]), "in the 90 % set" * (row["effect"] in chosen)]
        for row in result["which"]
        if row["probability"] >= LEAST_SHOWN
    ]
    show_table([Column("effect", False, 24), Column("probability"), Column("", False)], rows)


def show_simulator(found: dict, level: float) -> None:
    """The split of the gap between a simulator and the unit, and the parameters from the one to the other."""
    say(f"simulator {found['unit']}: {found['summary']}")
    if found["told"]:
        rows = [[words, share_text(found[key])] for key, words in SPLIT.items()]
        show_table([Column("share of the gap, on held-out data", False, 24), Column("share")], rows)
    rows = []
    for row in found["parameters"]:
        size = max(abs(row["simulated"]), *(abs(row["measured"][end]) for end in ("lo", "hi")))
        unit, factor = ("′", ARCMIN_PER_RAD) if row["unit"] == "rad" else _in_prefix(row["unit"], size)
        own = like_interval(row["simulated"], row["simulated_interval"], factor)
        moved = "changed" if row["credible"] else ""
        rows.append([f"{words(row['name'])} {f'[{unit}]' if unit else ''}", own,
                     _cell(row["measured"], factor), moved])  # fmt: skip
    columns = [Column("parameter", False, 20), Column("simulator"), Column("unit"), Column("", False)]
    show_table(columns, rows, f"Median, of the unit with its {level_text(level)} interval")


def _record(record: dict) -> str:
    return f"{_SUFFIX.sub('', record['file'])}\n{_condition(record)}"


def _condition(row: dict) -> str:
    predicted = " (predicted)" if row.get("predicted") else ""
    return f"{plain(row['loading_rate_Nm_per_s'])}, ±{plain(row['amplitude_Nm'])}{predicted}"


def _cell(interval: dict | None, factor: float = 1.0, provisional: bool = False) -> str:
    if interval is None:
        return "–"
    text = marked(interval_text(interval, factor), provisional)
    return text if width() >= ONE_LINE else text.replace(" [", "\n[", 1)


def _ratio(found: dict | None) -> str:
    if not found:
        return "–"
    if not found["ratio"]:
        return f"{_CONTRASTS.get(found['verdict'], found['verdict'])} no ratio"
    median, _, rest = _cell(found["ratio"]).partition("\n" if width() < ONE_LINE else " ")
    return f"{_CONTRASTS.get(found['verdict'], found['verdict'])} {median}{chr(10) if width() < ONE_LINE else ' '}{rest}"


def _limit(row: dict) -> tuple[str, float]:
    """A limit in words, and the factor into the unit in which it is shown."""
    ends = [row[end] if row[end] is not None and math.isfinite(row[end]) else None for end in ("min", "max")]
    unit, factor = _in_prefix(row["unit"], max(abs(end) for end in [*ends, row["median"]] if end is not None))
    # As many digits as it takes to see that the limits differ.
    for digits in range(4, 16):
        low, high = (None if end is None else f"{end * factor:.{digits}g}" for end in ends)
        if low != high or ends[0] == ends[1]:
            break
    bounds = f"{low} to {high}" if low and high else f"≤ {high}" if high else f"≥ {low}"
    return f"{_symbol(row['indicator'])} {bounds} {unit}".rstrip(), factor


def _in_prefix(unit: str, size: float) -> tuple[str, float]:
    """The unit with the prefix in which a size is at least one, and its factor."""
    if unit == "1":
        return "", 1.0
    prefixes = (("", 1.0), ("m", 1e3), ("µ", 1e6))
    return next(((f"{p}{unit}", f) for p, f in prefixes if size * f >= 1.0), (f"µ{unit}", 1e6))


def _symbol(name: str) -> str:
    return _SYMBOLS.get(name) or re.sub("_(rad|Nm|J)$", "", name).replace("_over_", "/")
