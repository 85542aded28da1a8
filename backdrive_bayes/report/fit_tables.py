"""The tables of a fit's chapter, from the saved indicators alone."""

from __future__ import annotations

from backdrive_bayes.figures.style import MJ_PER_J, PER_FIGURE, parts, record_labels, shown_unit, words
from backdrive_bayes.number_text import ARCMIN_PER_RAD, ENDS, fixed, interval_text, level_text, marked, significant
from backdrive_bayes.report.blocks import Note, Table
from backdrive_bayes.report.findings import FORCED, PROVISIONAL
from backdrive_bayes.report.text import free
from backdrive_bayes.results import usable

INDICATORS = (
    ("lost_motion_rad", "Lost motion δ", "arcmin", ARCMIN_PER_RAD),
    ("zero_torque_width_rad", "Width at zero torque w(0)", "arcmin", ARCMIN_PER_RAD),
    ("peak_angle_rad", "Peak angle", "arcmin", ARCMIN_PER_RAD),
    ("loop_area_J", "Dissipated energy S", "mJ", MJ_PER_J),
    ("absorbed_J", "Absorbed energy W_abs", "mJ", MJ_PER_J),
    ("dissipation_ratio", "Dissipation ratio u = S/W_abs", "–", 1.0),
)
"""Key in indicators.json, name, display unit and factor of the contract's indicators."""


def indicators(saved, at_most: int | None = None) -> list:
    """Tables of the indicators, three records side by side."""
    records, labels = saved.records[:at_most], record_labels(saved.records)
    level, k, provisional = level_text(saved.indicators["level"]), saved.indicators["k"], not usable(saved.indicators)
    blocks: list = []
    for part in parts(list(zip(labels, records, strict=False)), PER_FIGURE):
        rows = [
            [name, unit, *(indicator_text(key, r, factor, provisional) for _, r in part)]
            for key, name, unit, factor in INDICATORS
        ]
        columns = ["Indicator", "Unit", *(label for label, _ in part)]
        blocks.append(Table(columns, rows, [1.6, 0, *[1.4] * len(part)]))
    left = len(saved.records) - len(records)
    more = f" {left} further records follow on the next pages." if left > 0 else ""
    marks = f" {PROVISIONAL}" * provisional + f" {FORCED}" * bool(saved.indicators.get("forced"))
    blocks.append(
        Note(
            f"Median [{level} interval] of the reducer's own settled loop. δ is taken at ±kT_r with k = {k:g}.{marks}{more}"
        )
    )
    return blocks


def indicator_text(key: str, record: dict, factor: float, provisional: bool = False) -> str:
    """An indicator's interval as text, marked where it is ``provisional``."""
    return marked(interval_text(record["indicators"].get(key), factor), provisional)


def _by_record(saved, columns, cells):
    """One row a record under ``Record`` and ``columns``."""
    rows = [[label, *cells(r)] for label, r in zip(record_labels(saved.records), saved.records, strict=True)]
    return Table(["Record", *columns], rows, [1.3, *[1.0] * len(columns)])


def mechanism(saved) -> list:
    """Areas that the geometric and friction modules enclose."""

    def split(r):
        m = r["mechanism"]
        return [interval_text(m.get(f"S_{x}_J"), MJ_PER_J) for x in "gf"] + [
            interval_text(m.get(f"S_{x}_over_S")) for x in "gf"
        ]

    return [
        _by_record(saved, ["S_g [mJ]", "S_f [mJ]", "S_g/S [–]", "S_f/S [–]"], split),
        Note(
            f"{_interval(saved)} S_g and S_f: energy that the geometric error and friction dissipate in a cycle; what is left "
            "of S is due to effects. A share below zero or above one means that the data do not tell the two apart."
        ),
    ]


def ranges(saved) -> list:
    """Bounds of the ranges W1, W2 and W3, and what a load turns and stores."""
    found = [r["torque_energy"].get(key) for r in saved.records for key in _HUMP]
    factor, unit = shown_unit("N·m", [f[k] for f in found if f for k in ENDS])

    def cells(r):
        b = r["back_drive"]
        bounds = [interval_text(r["torque_energy"][key], factor) for key in _HUMP]
        return [*bounds, interval_text(b["theta_L_rad"], ARCMIN_PER_RAD), interval_text(b["W_L_J"], MJ_PER_J)]

    return [
        _by_record(saved, [f"τ₁ [{unit}]", f"τ₂ [{unit}]", "θ_L [arcmin]", "W_L [mJ]"], cells),
        Note(
            f"{_interval(saved)} τ₁: half the rise from the valley to the hump; τ₂: half the fall after it (this package's "
            "convention). θ_L, W_L: angle turned and energy absorbed when a load as large as the amplitude, but no larger than "
            "T_r, arrives at zero torque on the rising branch of the settled loop."
        ),
        *_loads(saved),
    ]


def _loads(saved) -> list:
    """What the loads turn and store that were asked for; nothing where none were."""
    rows = [
        [
            significant(row["load_Nm"]),
            significant(row["loading_rate_Nm_per_s"]),
            interval_text(row["theta_L_rad"], ARCMIN_PER_RAD),
            interval_text(row["W_L_J"], MJ_PER_J),
            " and ".join(_PREDICTED.get(p, free(p, 20)) for p in row["predicted"]) or "no",
        ]
        for row in saved.indicators.get("loads") or []
    ]
    if not rows:
        return []
    columns = ["load τ_L [N·m]", "rate [N·m/s]", "angle θ_L [arcmin]", "energy W_L [mJ]", "predicted"]
    return [
        Table(columns, rows, [0.8, 0.7, 1.2, 1.2, 0.9]),
        Note(
            f"{_interval(saved)} Loads that were asked for. Predicted: the load lies beyond the largest amplitude measured at "
            "that rate, or the rate was not measured; intervals are widened beyond the largest torque and the measured rates."
        ),
    ]


_PREDICTED = {"load": "load", "loading_rate": "rate"}


def _interval(saved):
    return f"Median [{level_text(saved.indicators['level'])} interval]."


_HUMP = ("tau1_Nm", "tau2_Nm")
def noise(saved) -> list:
    """Noise levels in a sentence, as their range over the records."""

    def span(key, factor):
        values = [r["noise"][key] for r in saved.records]
        ends = [significant(v, 2, factor) for v in (min(values), max(values))]
        return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"

    jitter = saved.indicators["jitter"]
    size, length = (significant(jitter[k], 2, 1e3) for k in ("torque_Nm", "length_Nm"))
    return [
        Note(
            f"Noise, as standard deviations: angle {span('white_rad', ARCMIN_PER_RAD)} arcmin white and "
            f"{span('correlated_rad', ARCMIN_PER_RAD)} arcmin correlated over {span('correlation_time_s', 1e3)} ms, torque "
            f"{span('torque_Nm', 1e3)} mN·m. Crossing torques repeat to {size} mN·m, correlated over {length} mN·m."
        )
    ]


def quantity_name(saved, name: str) -> str:
    """A sampled quantity in words; ``name[1]`` is that of the second record."""
    base, bracket, record = name.partition("[")
    if bracket and record[:-1].isdecimal() and int(record[:-1]) < len(saved.records):
        return f"{words(base)}, {record_labels(saved.records)[int(record[:-1])]}"
    return free(words(name))


CRITERIA = (
    "Convergence: rank-normalised split R-hat and effective sample sizes (ESS) over independent ensembles, for every log scale "
    "and indicator. Converged means R-hat below 1.01 and both ESS at least 400 for all of them, and no contradiction with the "
    "measured cycles."
)


def convergence(saved) -> list:
    """Convergence numbers in a sentence."""
    found = saved.indicators["convergence"]
    said = "Converged" if found["converged"] else "NOT converged"
    slowest = quantity_name(saved, found.get("worst", "–"))
    numbers = f"bulk {fixed(found['min_bulk_ess'], 0)}, tail {fixed(found['min_tail_ess'], 0)}"
    return [Note(f"{said}: largest R-hat {fixed(found['max_rhat'], 4)}, smallest ESS {numbers}; slowest quantity: {slowest}.")]
