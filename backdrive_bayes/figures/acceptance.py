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
from backdrive_bayes.number_text import significant

CAPTION = (
    "Posterior of each limited indicator (histogram), its median (solid line), the limits (dashed lines; beyond them is out of "
    "limits) and the guard bands (shaded orange) that the median must keep free for acceptance. A cross marks the point estimate "
    "of the classic least-squares fit; an arrow, with the value beneath, stands for what lies beyond the panel."
)
AT_MOST = 4
"""Limits in one figure."""
ROOM = 0.12
"""Free share of a panel beside what must be seen."""
FAR = 25.0
"""Widths of the histogram beyond it at which a limit would squeeze it to a line."""


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
    beyond: list[str] = []
    panel.stairs(counts, edges, fill=True, color=BLUE, alpha=0.35, label="posterior")
    panel.axvline(row["median"] * factor, color=BLUE, linewidth=1.2, label="median")
    for limit, guard, side in ((high, "below_max", -1), (low, "above_min", 1)):
        if limit is None:
            continue
        if left <= limit <= right:
            end = limit + side * row["guard_band"][guard] * factor
            panel.axvspan(*sorted((limit, end)), color=ORANGE, alpha=0.35, linewidth=0, label="guard band")
            panel.axvline(limit, color=VERMILLION, linestyle=(0, (5, 2)), linewidth=1.4, label="limit")
        else:
            beyond.append(f"limit {significant(limit)}")
            at, marker = (right, ">") if limit > right else (left, "<")
            panel.plot(at, 0.5, linestyle="none", marker=marker, color=VERMILLION, clip_on=False)
    panel.set(xlim=(left, right), ylim=(0, 1.12), yticks=[])
    classic = row["naive"]["value"]
    if classic is not None and not _mark_classic(panel, classic * factor, left, right):
        beyond.append(f"least squares {significant(classic * factor)}")
    # Beside the name of the axis: inside the panel it would lie over the limit or the posterior.
    panel.set_xlabel(f"{drawn_words(row['indicator'])} [{unit or '–'}]" + (f" ({', '.join(beyond)})" if beyond else ""))
    colour = {"accepted": GREEN, "rejected": VERMILLION}.get(row["verdict"], BLACK)
    predicted = ", predicted" if row["predicted"] else ""
    panel.set_title(f"{loop_words(row)}{predicted}: {row['verdict']}", color=colour)
    panel.spines["left"].set_visible(False)
    few_ticks(panel, 4, None)


def _mark_classic(panel, value, left, right) -> bool:
    """A cross, or an arrow at the edge where the value lies beyond it; whether it lies inside."""
    inside = left <= value <= right
    at = float(np.clip(value, left, right))
    marker = "x" if inside else ">" if value > right else "<"
    panel.plot(at, 0.06, linestyle="none", marker=marker, color=BLACK, clip_on=inside, label="least squares" if inside else None)
    return inside


def _range(edges, counts, low, high):
    """The histogram and, unless that would squeeze it to a line, its limits."""
    seen = [edges[np.flatnonzero(counts > 0)[0]], edges[np.flatnonzero(counts > 0)[-1] + 1]]
    width = seen[1] - seen[0]
    # A far limit is left out of sight rather than the posterior.
    near = [limit for limit in (low, high) if limit is not None and seen[0] - FAR * width < limit < seen[1] + FAR * width]
    seen = [min(*seen, *near), max(*seen, *near)]
    margin = ROOM * (seen[1] - seen[0])
    return seen[0] - margin, seen[1] + margin
