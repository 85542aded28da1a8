"""The gap between a simulator and a unit: shares of what closes it, and the gap along the loop at each stage."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.residual_panels import by_record, draw_panels
from backdrive_bayes.figures.style import BLUE, ORANGE, PER_FIGURE, few_ticks, legend_below, new_figure, styled

CAPTION = (
    "What separates the simulator from the unit. Above: shares of the gap above the noise on held-out data that re-tuning the "
    "simulator closes, that the missing effect closes beside, and that is left, with intervals at the ends of the bars. Beneath: "
    "measured minus simulated angle along the loop, the simulator as it is, re-tuned, and with what it lacks."
)
PARTS = (
    ("retuning", "closed by re-tuning", BLUE, ""),
    ("effect", "closed by what is missing", ORANGE, "////"),
    ("left", "left", "#DCDCDC", "...."),
)
STAGES = (("before_rad", "as it is"), ("retuned_rad", "re-tuned"), ("after_rad", "with what\nit lacks"))


def draw(saved: Diagnosed):
    """Bars of the shares, of each held-out record and of all; curves of the first records."""
    bars, entries = rows(saved), by_record(saved)
    records = [r for r in sorted(entries) if entries[r].get("retuned_rad")][:PER_FIGURE]
    stages = STAGES if saved.effects and saved.effects != ["unknown"] else STAGES[:2]
    heights = (0.85 + 0.3 * len(bars) if bars else 0.0, 0.6 + 0.95 * len(stages) if records else 0.0)
    with styled():
        figure = new_figure(sum(heights))
        shown = [(h, part) for h, part in zip(heights, (_bars, _curves), strict=True) if h]
        parts = figure.subfigures(len(shown), 1, squeeze=False, height_ratios=[h for h, _ in shown])[:, 0]
        for part, (_, draw_part) in zip(parts, shown, strict=True):
            draw_part(part, saved, bars if draw_part is _bars else (records, stages))
    return figure


def rows(saved: Diagnosed) -> list[tuple[str, dict]]:
    """Name and shares of each held-out record and of all together; none where the gap cannot be told."""
    found = saved.simulator
    if not found.get("told") or saved.inconclusive:
        return []
    whole = {"retuning": found["closed_by_retuning"], "effect": found["closed_by_effect"], "left": found["left"]}
    named = [(saved.labels[saved.numbers[r["record"]]], r) for r in found.get("records", []) if r["record"] in saved.numbers]
    return [*(named if len(named) > 1 else []), ("all together", whole)]


def _bars(part, saved, shown):
    axes = part.subplots()
    for y, (_, shares) in enumerate(shown):
        begin = 0.0
        for key, name, colour, hatch in PARTS:
            median, lo, hi = (100 * shares[key][end] for end in ("median", "lo", "hi"))
            axes.barh(y, median, left=begin, height=0.62, color=colour, hatch=hatch, edgecolor="white", linewidth=0.5,
                      label=name if y == 0 else None)  # fmt: skip
            if key != "left":
                axes.plot([begin + lo, begin + hi], [y, y], color="black", linewidth=1.2, solid_capstyle="butt")
            begin += median
        text = " / ".join(f"{100 * shares[key]['median']:.0f}".replace("-", "−") for key, *_ in PARTS)
        axes.annotate(f"{text} %", (1.01, y), xycoords=("axes fraction", "data"), va="center", annotation_clip=False)
    axes.set_yticks(range(len(shown)), [name for name, _ in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.axvline(0, color="black", linewidth=0.6)
    axes.axvline(100, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
    few_ticks(axes, 10, None)
    axes.set_xlabel("share of the gap [%]; dashed: down to the noise")
    axes.set_title("What closes the gap?", loc="left", fontweight="bold")
    part.legend(loc="outside upper right", ncols=3, handletextpad=0.4, columnspacing=1.2)


def _curves(part, saved, given):
    panels = draw_panels(part, saved, *given, _line, 4)
    legend_below(part, panels[0, 0], columns=3)


def _line(axes, torque, angle, own, look, name):
    axes.plot(torque, np.where(own, angle, np.nan), label=name, linewidth=0.9, **look)
