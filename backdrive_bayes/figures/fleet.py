"""Figures of a fleet, from fleet.json alone: control charts with drift, distributions, shares of verdicts and effects."""

from __future__ import annotations

from matplotlib.ticker import MaxNLocator

from backdrive_bayes.figures.fonts import drawn_names
from backdrive_bayes.figures.style import (
    BLUE,
    GREY,
    SERIES,
    VERMILLION,
    Figure,
    display_unit,
    drawn_words,
    few_ticks,
    legend_below,
    new_figure,
    settled,
    styled,
    two_lines,
    words,
)
from backdrive_bayes.number_text import probability_text

CAPTIONS = {
    "fleet-charts": "Control charts, one point a unit, with its interval in small fleets: centre (line), three sigma from moving "
    "ranges (broken), units outside them (squares); the centre changes where drift is found. Right: difference of the units from "
    "each one on from those before, in its standard deviations, with the limits that a fleet without drift passes at the stated "
    "rate.",
    "fleet-distributions": "Distribution of the indicators' medians over the fleet (filled), and of batches where they are few.",
    "fleet-shares": "Units by verdict, and by the effect that the diagnosis names.",
}
MOST_BATCHES = 4
MOST_INTERVALS = 150
"""Units up to which intervals and points are drawn one by one."""
_ORDERS = {"unit": "path", "test_date": "test date", "serial": "serial number"}
_UNITS = {"lost_motion_rad": "rad", "loop_area_J": "J", "dissipation_ratio": "1"}


def order_words(result: dict) -> str:
    """What the units are in order of."""
    return _ORDERS[result["order"]]


def chart_unit(chart: dict) -> tuple[float, str]:
    """Factor and name of the unit in which a chart's indicator is shown."""
    return display_unit(_UNITS[chart["indicator"]])


def fleet_figures(result: dict) -> dict[str, Figure]:
    """Every figure that the object of fleet.json has something for, by the names of ``CAPTIONS``."""
    with styled():
        found = {"fleet-charts": _charts(result), "fleet-distributions": _distributions(result)} if result["charts"] else {}
        if result["verdicts"] or result["effects"]:
            found["fleet-shares"] = _shares(result)
    return settled(found)


def _charts(result):
    figure = new_figure(2.0 * len(result["charts"]))
    grid = figure.subplots(len(result["charts"]), 2, sharex=True, width_ratios=[1.7, 1.0], squeeze=False)
    for (left, right), chart in zip(grid, result["charts"], strict=True):
        _individuals(left, chart, result)
        _differences(right, chart)
    for axes in grid[-1]:
        axes.set_xlabel(f"unit in order of {order_words(result)}")
        axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    return figure


def _individuals(axes, chart, result):
    factor, unit = chart_unit(chart)
    y, lo, hi = ([factor * v for v in chart[key]] for key in ("median", "lo", "hi"))
    x = range(1, len(y) + 1)
    outside = set(chart["outside"])
    beyond = [u["unit"] in outside for u in result["charted"]]
    few = len(y) <= MOST_INTERVALS
    if few:
        axes.vlines(x, lo, hi, color=BLUE, linewidth=0.7, alpha=0.6)
    axes.plot(x, y, linestyle="none", marker="o", markersize=2.5 if few else 1.0, color=BLUE)
    axes.plot([i for i, b in zip(x, beyond, strict=True) if b], [v for v, b in zip(y, beyond, strict=True) if b],
              linestyle="none", marker="s", markersize=5 if few else 3, markerfacecolor="none", color=VERMILLION)  # fmt: skip
    for side in (-1, 0, 1) if chart["sigma"] > 0 else (0,):
        line = [factor * (c + side * result["sigmas"] * chart["sigma"]) for c in chart["centre"]]
        axes.step(x, line, where="mid", color=GREY, linewidth=0.9, linestyle=(0, (5, 3)) if side else "-", zorder=3)
    axes.set_ylabel(two_lines(drawn_words(chart["indicator"]), f"[{unit}]" if unit else "[–]"))


def _differences(axes, chart):
    if chart["drift"] is None:
        axes.text(0.5, 0.5, "too few units\nto find drift", transform=axes.transAxes, ha="center", va="center", color="0.3")
        axes.set_axis_off()
        return
    axes.axhline(0.0, color=GREY, linewidth=0.6)
    path, limit = chart["drift"]["path"], chart["drift"]["limit"]
    x = range(1, len(path) + 1)
    axes.plot(x, path, color=BLUE, linewidth=1.1)
    axes.plot([i for i, v in zip(x, path, strict=True) if abs(v) > limit], [v for v in path if abs(v) > limit],
              linestyle="none", marker="s", markersize=3 if len(path) <= MOST_INTERVALS else 1, color=VERMILLION)  # fmt: skip
    for side in (-limit, limit):
        axes.axhline(side, color=GREY, linewidth=0.9, linestyle=(0, (5, 3)))
    told = "drift" if chart["drift"]["alarm"] else "no drift"
    axes.set_title(f"{told}, by chance {probability_text(chart['drift']['probability'])}")
    axes.set_ylabel("difference [sd]")


def _distributions(result):
    figure = new_figure(2.4)
    batches = [b["batch"] for b in result["batches"]["rows"]] if result["batches"] else []
    batches = batches if len(batches) <= MOST_BATCHES else []
    for axes, chart in zip(figure.subplots(1, len(result["charts"]), squeeze=False)[0], result["charts"], strict=True):
        factor, unit = chart_unit(chart)
        values = [factor * v for v in chart["median"]]
        bins = min(30, max(5, int(2 * len(values) ** 0.5)))
        low, high = min(values), max(values)
        edges = [low + (high - low or 1.0) * i / bins for i in range(bins + 1)]
        axes.hist(values, edges, color="0.85")
        shown = drawn_names(batches)
        for look, batch in zip(SERIES, batches, strict=False):
            own = [v for v, u in zip(values, result["charted"], strict=True) if u["batch"] == batch]
            axes.hist(own, edges, histtype="step", color=look["color"], linestyle=look["linestyle"], label=shown[batch])
        axes.set_xlabel(f"{drawn_words(chart['indicator'])}{f' [{unit}]' if unit else ''}")
        few_ticks(axes)
    figure.axes[0].set_ylabel("units")
    if batches:
        legend_below(figure, figure.axes[0], columns=4)
    return figure


def _shares(result):
    panels = [(title, result[key]) for key, title in (("verdicts", "verdict"), ("effects", "diagnosed effect")) if result[key]]
    figure = new_figure(0.9 + 0.22 * max(len(counts) for _, counts in panels))
    for axes, (title, counts) in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        names, total = list(counts), sum(counts.values())
        bars = axes.barh([words(n).replace("+", " + ") for n in names], list(counts.values()), color=BLUE, height=0.6)
        axes.bar_label(bars, [f"{n} ({_share(n / total)})" for n in counts.values()], padding=3, fontsize=7.5)
        axes.invert_yaxis()
        axes.set_xlim(0, 1.35 * max(counts.values()))
        axes.set_xlabel("units")
        axes.set_title(title)
        axes.xaxis.set_major_locator(MaxNLocator(4, integer=True))
    return figure


def _share(share):
    return f"{100 * share:.0f} %" if share >= 0.005 else "< 1 %"
