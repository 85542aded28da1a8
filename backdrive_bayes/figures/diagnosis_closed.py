"""How far the gap shrinks on held-out records, beside what a curve without a cause would do."""

from __future__ import annotations

from typing import Any

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.fonts import drawable
from backdrive_bayes.figures.style import (
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    few_ticks,
    matplotlib,
    new_figure,
    styled,
)
from backdrive_bayes.number_text import ARCMIN_PER_RAD, share_text

CAPTION = (
    "Closed fraction of the gap on held-out data: value and interval of each record and of all of them, with "
    "the named effect added to the model. Beneath, as a control, a Gaussian process that may bend anywhere: it "
    "closes a gap too, but names no cause. Below zero: worse than before."
)
AT_MOST = 24
"""Records in one figure."""
FAR = -60
"""Fractions below this [%] leave the figure; their numbers stay."""


def rows(saved: Diagnosed, records: list[int]) -> list[tuple[str, dict]]:
    """Name and numbers of each part held out (a record, or a leg or cycle of one), and of all together."""
    parts = saved.shrink.get("records") or []
    whole = [p for p in parts if p["record"] in saved.numbers]
    if whole:
        single = [(saved.labels[saved.numbers[p["record"]]], p) for p in whole if saved.numbers[p["record"]] in records]
    else:
        single = [(drawable(p["record"], 24), p) for p in parts[:AT_MOST]]
    return single if len(parts) == 1 else [*single, ("all together", saved.shrink)]


def draw_before_after(axes, saved: Diagnosed, records: list[int]) -> None:
    """Rms before and after as ends of an arrow, the noise floor as a bar beneath, the closed fraction in figures."""
    shown = rows(saved, records)
    for y, (_, entry) in enumerate(shown):
        before, after, noise = (entry[k] * ARCMIN_PER_RAD for k in ("before_rad", "after_rad", "noise_floor_rad"))
        axes.barh(y, noise, height=0.7, color="#DCDCDC", hatch="....", edgecolor="#B0B0B0", linewidth=0)
        axes.plot([before, after], [y, y], color=GREY, linewidth=1.4, zorder=2)
        axes.plot(before, y, "o", color=VERMILLION, markerfacecolor="white", markeredgewidth=1.4, markersize=6)
        axes.plot(after, y, "o", color=BLUE, markersize=6)
        text = share_text(entry.get("closed_fraction")).partition(" [")[0]
        axes.annotate(text, (1.02, y), xycoords=("axes fraction", "data"), va="center", annotation_clip=False, fontweight="bold")
    top = max(max(e["before_rad"], e["after_rad"], e["noise_floor_rad"]) for _, e in shown) * ARCMIN_PER_RAD
    axes.set_xlim(0, 1.08 * top)
    few_ticks(axes, 4)
    _names(axes, [name for name, _ in shown])
    axes.set_title("How far does it close?", loc="left", fontweight="bold")
    axes.set_xlabel("rms on held-out data [arcmin]")


def before_after_handles() -> list:
    """Legend entries of :func:`draw_before_after`."""
    line = matplotlib.lines.Line2D
    looks: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 6}
    return [
        line([], [], **looks, color=VERMILLION, markerfacecolor="white", markeredgewidth=1.4, label="before"),
        line([], [], **looks, color=BLUE, label="after"),
        matplotlib.patches.Patch(facecolor="#DCDCDC", hatch="....", edgecolor="#B0B0B0", linewidth=0, label="noise floor"),
    ]


def draw(saved: Diagnosed, records: list[int]):
    """Closed fraction [%] of each record and of all, and that of the control."""
    shown = [(name, entry.get("closed_fraction")) for name, entry in rows(saved, records)]
    control = (saved.shrink.get("gaussian_process") or {}).get("closed_fraction")
    with styled():
        figure = new_figure(0.95 + 0.27 * (len(shown) + bool(control)))
        axes = figure.subplots()
        for y, (_, fraction) in enumerate(shown):
            _interval(axes, y, fraction, BLUE, "o")
        if control:
            axes.axhline(len(shown) - 0.5, color="black", linewidth=0.6)
            _interval(axes, len(shown), control, ORANGE, "s")
        axes.axvline(100, color="black", linewidth=0.7, linestyle=(0, (4, 2)))
        axes.set_xlim(min(0, max(FAR, axes.get_xlim()[0])), 103)
        few_ticks(axes, 10, None)
        _names(axes, [name for name, _ in shown] + ["Gaussian process (control)"] * bool(control))
        axes.set_xlabel("closed fraction of the gap [%]; dashed: down to the noise")
    return figure


def _interval(axes, y, fraction, colour, marker):
    axes.annotate(share_text(fraction), (1.01, y), xycoords=("axes fraction", "data"), va="center", annotation_clip=False)
    if fraction:
        axes.plot([100 * fraction["lo"], 100 * fraction["hi"]], [y, y], color=colour, linewidth=2.2, alpha=0.75)
        axes.plot(100 * fraction["median"], y, marker, color=colour, markeredgecolor="black", markersize=6)


def _names(axes, names):
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0)
