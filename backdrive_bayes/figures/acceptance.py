"""What is known of each limited indicator, against its limits and guard bands."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    VERMILLION,
    display_unit,
    drawn_words,
    few_ticks,
    legend_below,
    loop_words,
    new_figure,
    styled,
)

CAPTION = (
    "Posterior of each limited indicator (histogram), its median (solid line), the limits (dashed lines; beyond them is out of "
    "limits) and the guard bands (shaded orange) that the median must keep free for acceptance. A cross marks the point estimate "
    "of the classic least-squares fit, an arrow one that lies beyond the panel."
)
AT_MOST = 4
"""Limits in one figure."""
ROOM = 0.12
"""Free share of a panel beside what must be seen."""


def draw(verdict: dict, rows: list[int]):
    """Panels of the given rows of a verdict object, two beside each other."""
    columns = min(2, len(rows))
    lines = -(-len(rows) // columns)
    with styled():
        figure = new_figure(0.6 + 0.92 * lines)
        axes = figure.subplots(lines, columns, squeeze=False).ravel()
        for panel, row in zip(axes, rows, strict=False):
            _panel(panel, verdict["limits"][row])
        for panel in axes[len(rows) :]:
            panel.set_visible(False)
        legend_below(figure, *axes[: len(rows)], columns=5)
    return figure


def _panel(panel, row):
    factor, unit = display_unit(row["unit"])
    edges, counts = np.asarray(row["histogram"]["edges"]) * factor, np.asarray(row["histogram"]["counts"], float)
    counts = counts / max(counts.max(), 1.0)
    low, high = (None if row[k] is None else row[k] * factor for k in ("min", "max"))
    left, right = _range(edges, counts, low, high)
    panel.stairs(counts, edges, fill=True, color=BLUE, alpha=0.35, label="posterior")
    panel.axvline(row["median"] * factor, color=BLUE, linewidth=1.2, label="median")
    for limit, guard, side in ((high, "below_max", -1), (low, "above_min", 1)):
        if limit is not None:
            end = limit + side * row["guard_band"][guard] * factor
            panel.axvspan(*sorted((limit, end)), color=ORANGE, alpha=0.35, linewidth=0, label="guard band")
            panel.axvline(limit, color=VERMILLION, linestyle=(0, (5, 2)), linewidth=1.4, label="limit")
    panel.set(xlim=(left, right), ylim=(0, 1.12), yticks=[], xlabel=f"{drawn_words(row['indicator'])} [{unit or '–'}]")
    classic = row["naive"]["value"]
    if classic is not None:
        _mark_classic(panel, classic * factor, left, right)
    colour = {"accepted": GREEN, "rejected": VERMILLION}.get(row["verdict"], BLACK)
    predicted = ", predicted" if row["predicted"] else ""
    panel.set_title(f"{loop_words(row)}{predicted}: {row['verdict']}", color=colour)
    panel.spines["left"].set_visible(False)
    few_ticks(panel, 4, None)


def _mark_classic(panel, value, left, right):
    """A cross, or an arrow at the edge with the value that lies beyond it."""
    inside = left <= value <= right
    at = float(np.clip(value, left, right))
    marker = "x" if inside else ">" if value > right else "<"
    panel.plot(at, 0.06, linestyle="none", marker=marker, color=BLACK, clip_on=inside, label="least squares" if inside else None)
    if not inside:
        # Beside the name of the axis: inside the panel it would lie over the limit or the posterior.
        panel.set_xlabel(f"{panel.get_xlabel()} (least squares {value:.3g})")


def _range(edges, counts, low, high):
    """The histogram and, unless that would squeeze it to a line, its limits."""
    seen = [edges[np.flatnonzero(counts > 0)[0]], edges[np.flatnonzero(counts > 0)[-1] + 1]]
    width = seen[1] - seen[0]
    for limit in (low, high):
        if limit is not None:
            seen = [min(seen[0], limit), max(seen[1], limit)]
    # A far limit is left out of sight rather than the posterior.
    middle = 0.5 * (edges[0] + edges[-1])
    seen = [max(seen[0], middle - 25 * width), min(seen[1], middle + 25 * width)]
    margin = ROOM * (seen[1] - seen[0])
    return seen[0] - margin, seen[1] + margin
