"""Figures of a pooled batch, from pool.json alone: units before and after pooling, and how much units differ in each quantity."""

from __future__ import annotations

from backdrive_bayes.figures.fonts import drawn_names
from backdrive_bayes.figures.style import (
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    Figure,
    drawn_words,
    few_ticks,
    legend_below,
    new_figure,
    settled,
    shown_unit,
    styled,
    two_lines,
)
from backdrive_bayes.number_text import level_text, plain

CAPTIONS = {
    "pool-units": "Units of the batch in order of the first indicator, with {level} intervals: each by itself (grey) and with "
    "what the others tell of it (blue; a square has none, see the table). Line and dark band: the batch's mean; light band: "
    "where the next unit is expected.",
    "pool-spread": "How much the units differ: spread of each positive quantity in the batch (standard deviation of its "
    "logarithm, in per cent), with {level} intervals; they begin at zero where the units need not differ at all.",
}
SHOWN = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")
MOST_UNITS = 40
"""Units in the figure; of more, as many evenly taken."""


def caption(name: str, result: dict) -> str:
    """What a figure shows, in words."""
    return CAPTIONS[name].format(level=level_text(result["level"]))


def pool_figures(result: dict) -> dict[str, Figure]:
    """Every figure that the object of pool.json has something for, by the names of ``CAPTIONS``."""
    with styled():
        chosen, spreads = shown_quantities(result), [q for q in result["quantities"] if not q["refused"] and q["scale"] == "log"]
        found = {"pool-units": _units(chosen)} if chosen else {}
        return settled(found | ({"pool-spread": _spreads(spreads)} if spreads else {}))


def shown_quantities(result: dict) -> list[dict]:
    """The indicators of ``SHOWN`` that were pooled, at the largest loop of the lowest rate that most units share."""
    pooled = [q for q in result["quantities"] if q["name"] in SHOWN and not q["refused"]]
    if not pooled:
        return []
    best = max(pooled, key=lambda q: (q["units"], q["amplitude_Nm"], -q["loading_rate_Nm_per_s"]))
    at = best["loading_rate_Nm_per_s"], best["amplitude_Nm"]
    here = [q for q in pooled if (q["loading_rate_Nm_per_s"], q["amplitude_Nm"]) == at]
    return sorted(here, key=lambda q: SHOWN.index(q["name"]))


def unit_of(quantity: dict) -> tuple[float, str]:
    """Factor and name of the unit in which a quantity is shown."""
    return shown_unit(quantity["unit"], [quantity["of_units"][0]["own"]["hi"]])


def quantity_words(quantity: dict, loops: int) -> str:
    """A quantity in words, with its loop where the batch has several."""
    at = f" at {plain(quantity['loading_rate_Nm_per_s'], 2)} N·m/s" if quantity["amplitude_Nm"] is not None and loops > 1 else ""
    return f"{drawn_words(quantity['name'])}{at}"


def _units(chosen):
    order = [r["unit"] for r in sorted(chosen[0]["of_units"], key=lambda r: r["own"]["median"])]
    taken = min(MOST_UNITS, len(order))
    order = [order[i * (len(order) - 1) // max(taken - 1, 1)] for i in range(taken)]
    figure = new_figure(1.1 + 0.13 * max(taken, 8))
    for axes, quantity in zip(figure.subplots(1, len(chosen), sharey=True, squeeze=False)[0], chosen, strict=True):
        _panel(axes, quantity, order)
    first = figure.axes[0]
    shown = drawn_names(order, 18)
    first.set_yticks(range(len(order)), [shown[name] for name in order])
    first.tick_params(axis="y", length=0, labelsize=7)
    first.set_ylim(len(order) - 0.4, -0.6)
    legend_below(figure, *figure.axes, columns=5)
    return figure


def _panel(axes, quantity, order):
    factor, unit = unit_of(quantity)
    rows = {r["unit"]: r for r in quantity["of_units"]}
    expected, mean = quantity["next_unit"], quantity["mean"]
    axes.axvspan(factor * expected["lo"], factor * expected["hi"], color=BLUE, alpha=0.10, linewidth=0, label="next unit")
    axes.axvspan(factor * mean["lo"], factor * mean["hi"], color=BLUE, alpha=0.25, linewidth=0, label="mean")
    axes.axvline(factor * mean["median"], color=BLUE, linewidth=0.9)
    for y, row in ((i, rows[name]) for i, name in enumerate(order) if name in rows):
        for kind, look in (("own", {"color": GREY, "y": y - 0.17}), ("pooled", {"color": BLUE, "y": y + 0.17})):
            found = row[kind]
            label = {"own": "unit alone", "pooled": "pooled"}[kind]
            if found:
                axes.plot([factor * found["lo"], factor * found["hi"]], [look["y"]] * 2, color=look["color"], linewidth=1.3)
                axes.plot(factor * found["median"], look["y"], marker="o", markersize=2.6, color=look["color"], linestyle="none",
                          label=label)  # fmt: skip
        if not row["pooled"]:
            axes.plot(factor * row["own"]["median"], y - 0.17, marker="s", markersize=5, markerfacecolor="none", color=VERMILLION,
                      linestyle="none", label="not pooled")  # fmt: skip
    axes.set_xlabel(two_lines(drawn_words(quantity["name"]), f"[{unit or '–'}]"))
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    few_ticks(axes, 4, None)


def _spreads(quantities):
    loops = len({(q["loading_rate_Nm_per_s"], q["amplitude_Nm"]) for q in quantities if q["amplitude_Nm"] is not None})
    figure = new_figure(0.7 + 0.17 * len(quantities))
    axes = figure.subplots()
    for y, q in enumerate(quantities):
        spread = q["spread"]
        axes.plot([100 * spread["lo"], 100 * spread["hi"]], [y, y], color=BLUE, linewidth=1.3)
        axes.plot(100 * spread["median"], y, marker="o", markersize=3.5, color=ORANGE, markeredgecolor=BLUE)
    axes.set_yticks(range(len(quantities)), [quantity_words(q, loops) for q in quantities])
    axes.set_ylim(len(quantities) - 0.4, -0.6)
    few_ticks(axes, 8, None)
    axes.set_xlim(left=0)
    axes.set_xlabel("spread of the units [%]")
    return figure
