"""Units beside each other: loops, torque–energy curves, ratios of indicators, and how each releases energy."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.fonts import drawn_names
from backdrive_bayes.figures.style import (
    BLUE,
    GREY,
    MJ_PER_J,
    ORANGE,
    PER_FIGURE,
    SERIES,
    SKY,
    drawn_words,
    few_ticks,
    legend_below,
    loop_words,
    new_figure,
    parts,
    reach,
    styled,
)
from backdrive_bayes.number_text import ARCMIN_PER_RAD

LOOPS = "Settled loops of the units at the same rate and amplitude, each about its middle: median and interval of each."
ENERGY = "Torque–energy curves of the units at the same rate and amplitude: median and interval of each."
RATIOS = (
    "Ratios of the indicators at matched rate and amplitude: median and interval, on a logarithmic scale. The grey band is the "
    "region of practical equivalence. Indicators of which not all draws are positive have no ratio."
)
MECHANISM = (
    "How each unit releases energy. Left: energy that geometric error and friction dissipate, as shares of S; what is "
    "missing to 1 or goes beyond it is due to effects; bars end at 1.5. Right: share of the absorbed energy W_abs that was "
    "stored elastically and is given back. Medians with intervals."
)
SHOWN = ("lost_motion_rad", "zero_torque_width_rad", "peak_angle_rad", "loop_area_J", "absorbed_J", "dissipation_ratio")
MOST_OF_S = 1.5
"""Where the axis of shares ends: of a small loop they can be anything."""
SHARES = (("S_g_over_S", "geometric error", BLUE, ""), ("S_f_over_S", "friction", ORANGE, "////"))


def overlaid(comparison: dict) -> list[list[tuple[int, tuple[int, ...]]]]:
    """Figures of overlays: in each at most so many units as there are looks, at the conditions that some of them share."""
    groups = [tuple(group) for group in parts(list(range(len(comparison["names"]))), len(SERIES))]
    found = []
    for group in groups:
        shared = [(o, group) for o in range(len(comparison["overlays"])) if any(_members(comparison, o, group))]
        found += parts(shared, PER_FIGURE)
    return found


def draw_loops(comparison: dict, conditions: list[tuple[int, tuple[int, ...]]]):
    """Overlaid loops at the given overlays (at most three) of a group of units, angle [arcmin] over torque [N·m]."""
    return _overlaid(comparison, conditions, 2.3, _one_loop, "angle [arcmin]", xlabel="torque [N·m]")


def draw_energy(comparison: dict, conditions: list[tuple[int, tuple[int, ...]]]):
    """Overlaid torque–energy curves at the given overlays (at most three) of a group of units, mJ per N·m over |torque| [N·m]."""
    looks = {"xlabel": "|torque| [N·m]", "xlim": (0, None), "ylim": (0, None)}
    return _overlaid(comparison, conditions, 2.9, _one_energy, "energy per torque\n[mJ/(N·m)]", **looks)


def _overlaid(comparison, conditions, height, draw, ylabel, **looks):
    """A figure of that height [inch] with one panel a condition, ``draw`` called for every unit."""
    with styled():
        figure = new_figure(height)
        axes = _panels(figure, comparison, conditions)
        for panel, condition in zip(axes, conditions, strict=True):
            for record, look, name in _members(comparison, *condition):
                draw(panel, record, look, name)
        for panel in axes:  # only now: limits of a shared axis would hold for panels still to be drawn
            panel.set(**looks)
        axes[0].set_ylabel(ylabel)
        legend_below(figure, *axes, columns=4)
    return figure


def with_ratios(comparison: dict) -> list[int]:
    """The pairs of units that were measured at a common rate and amplitude."""
    return [i for i, pair in enumerate(comparison["pairs"]) if pair["conditions"]]


def draw_ratios(comparison: dict, pairs: list[int]):
    """Forest plot of the first of the given pairs of units, one series a condition."""
    both, shown_as = comparison["pairs"][pairs[0]], drawn_names(comparison["names"])
    shown = [name for name in SHOWN if any((c["indicators"].get(name) or {}).get("ratio") for c in both["conditions"])]
    with styled():
        figure = new_figure(0.9 + 0.05 * len(shown) * max(3.0, len(both["conditions"])))
        panel = figure.subplots()
        step = 0.7 / max(1, len(both["conditions"]))
        for i, condition in enumerate(both["conditions"]):
            look, label = SERIES[i % len(SERIES)], loop_words(condition) + ", predicted" * bool(condition.get("predicted"))
            for row, name in enumerate(shown):
                ratio = (condition["indicators"].get(name) or {}).get("ratio")
                if ratio:
                    at = row + (i - 0.5 * (len(both["conditions"]) - 1)) * step
                    _whisker(panel, ratio, at, look, label)
                    label = ""
        rope = comparison["rope"]
        panel.axvspan(1 / (1 + rope), 1 + rope, color=GREY, alpha=0.35, linewidth=0)
        panel.axvline(1.0, color="black", linewidth=0.7)
        panel.set(xscale="log", yticks=range(len(shown)), ylim=(len(shown) - 0.45, -0.55))
        panel.set_yticklabels([drawn_words(name) for name in shown])
        panel.set_xlabel(f"ratio: {shown_as[both['first']]} over {shown_as[both['second']]} [–]")
        _plain_log(panel)
        legend_below(figure, panel, columns=3)
    return figure


def draw_mechanism(comparison: dict):
    """Stacked shares of S and the elastic share of W_abs, one bar a unit and record."""
    shown_as = drawn_names(comparison["names"])
    bars = [(shown_as[m["unit"]], r) for m in comparison["mechanism"] for r in m["records"]]
    with styled():
        figure = new_figure(0.85 + 0.19 * len(bars))
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.5, 1])
        for row, (_, record) in enumerate(bars):
            begin = 0.0
            for key, name, colour, hatch in SHARES:
                begin += _bar(left, record[key], row, begin, name, colour, hatch)
            _bar(right, record["elastic_share"], row, 0.0, "given back", SKY, "")
        left.axvline(1.0, color="black", linewidth=0.7)
        left.set(xlim=(0, min(max(1.0, left.get_xlim()[1]), MOST_OF_S)), xlabel="share of S [–]", ylim=(len(bars) - 0.5, -0.5))
        left.set_yticks(range(len(bars)), [f"{name}, {loop_words(r)}" for name, r in bars])
        right.set(xlim=(0, 1), xlabel="given back/absorbed [–]")
        legend_below(figure, left, right, columns=3)
    return figure


def _bar(panel, interval, row, begin, name, colour, hatch) -> float:
    """One bar with its interval; its length."""
    if not interval:
        return 0.0
    length, label = interval["median"], name if row == 0 else None
    panel.barh(row, length, left=begin, height=0.66, label=label, color=colour, hatch=hatch, edgecolor="white", linewidth=0)
    panel.errorbar(begin + length, row, xerr=reach(interval), color="black", capsize=2, linewidth=0.8)
    return length


def _panels(figure, comparison, conditions):
    axes = figure.subplots(1, len(conditions), sharey=True, squeeze=False)[0]
    for panel, (overlay, _) in zip(axes, conditions, strict=True):
        panel.set_title(loop_words(comparison["overlays"][overlay]))
        few_ticks(panel, {1: 10, 2: 6, 3: 4}[len(conditions)])
    return axes


def _members(comparison, overlay, group):
    """Record object, look and name of every unit of a group in an overlay."""
    shown_as = drawn_names(comparison["names"])
    for member in comparison["overlays"][overlay]["units"]:
        unit = comparison["names"].index(member["unit"])
        if unit in group:
            yield comparison["units"][unit]["records"][member["record"]], SERIES[unit % len(SERIES)], shown_as[member["unit"]]


def _one_loop(panel, record, look, name):
    loop = record["loop"]
    # The encoder's zero is of no unit's making, and friction may hold a small loop far from the middle of a large one.
    middle = np.mean([loop[branch]["median"] for branch in ("rising_rad", "falling_rad")])
    for i, branch in enumerate(("rising_rad", "falling_rad")):
        lo, hi, median = ((np.asarray(loop[branch][k]) - middle) * ARCMIN_PER_RAD for k in ("lo", "hi", "median"))
        panel.fill_between(loop["torque_Nm"], lo, hi, color=look["color"], alpha=0.3, linewidth=0)
        panel.plot(loop["torque_Nm"], median, color=look["color"], linestyle=look["linestyle"], label=None if i else name)


def _one_energy(panel, record, look, name):
    curve = record["torque_energy"]
    lo, hi, median = (np.asarray(curve[k]) * MJ_PER_J for k in ("lo", "hi", "median_J_per_Nm"))
    panel.fill_between(curve["torque_Nm"], lo, hi, color=look["color"], alpha=0.3, linewidth=0)
    panel.plot(curve["torque_Nm"], median, color=look["color"], linestyle=look["linestyle"], label=name)


def _whisker(panel, interval, at, look, name):
    panel.errorbar(
        interval["median"], at, xerr=reach(interval), color=look["color"], marker=look["marker"], linestyle="none", label=name,
        markersize=4, markerfacecolor="white", capsize=2,
    )  # fmt: skip


def _plain_log(panel):
    """Ticks at 1, 2 and 5 in plain numbers where the axis is short, at decades where it is long."""
    low, high = panel.get_xlim()
    steps = (1, 2, 5) if high / low < 2000 else (1,)
    ticks = [s * 10.0**p for p in range(-9, 10) for s in steps]
    if high / low < 4:
        ticks = list(np.round(np.arange(0.1, 10, 0.1), 1))
    ticks = [t for t in ticks if low <= t <= high]
    panel.set_xticks(ticks, [f"{t:g}" for t in ticks])
    panel.minorticks_off()
