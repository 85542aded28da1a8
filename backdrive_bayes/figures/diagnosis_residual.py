"""What is left over along the loop, before and after the effect is added."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.style import (
    ARCMIN_PER_RAD,
    FALLING,
    GREY,
    RISING,
    TORQUE_TICKS,
    few_ticks,
    legend_below,
    new_figure,
    styled,
)

CAPTION = (
    "Measured minus modelled angle along the loop, before (baseline alone, or the simulator as it is) and after the chosen "
    "effect is added; little that is left is shown once more on its own scale."
)
ZOOM = 3.0
"""Where the residual shrinks by this factor, what is left gets a row with a scale of its own."""


def draw(saved: Diagnosed, records: list[int]):
    """Residuals [arcmin] over torque [N·m] of the given records in columns: before on top, after beneath.

    Where little is left, what is left is shown once more on its own scale.
    """
    entries = by_record(saved)
    rows = _rows([entries[r] for r in records]) if saved.enlarged else [("before_rad", "residual")]
    with styled():
        figure = new_figure(0.85 + 1.05 * len(rows))
        axes = figure.subplots(len(rows), len(records), sharex="col", sharey="row", squeeze=False)
        for column, record in zip(axes.T, records, strict=True):
            for panel, (key, _) in zip(column, rows, strict=True):
                _residual(panel, entries[record], key)
            column[0].set_title(saved.labels[record])
            column[-1].set_xlabel("torque [N·m]")
        for panel, (_, name) in zip(axes[:, 0], rows, strict=True):
            panel.set_ylabel(f"{name}\n[arcmin]")
        if len(rows) > 1:
            axes[1, 0].set_ylim(axes[0, 0].get_ylim())
        for panel in axes.ravel():
            few_ticks(panel, TORQUE_TICKS[len(records)], 5)
        figure.align_ylabels(axes[:, 0])
        legend_below(figure, axes[0, 0], columns=3, markerscale=1.8)
    return figure


def by_record(saved: Diagnosed) -> dict[int, dict]:
    """Residual objects by the number of their record."""
    found = saved.result.get("residual") or []
    return {saved.numbers[r["record"]]: r for r in found if r["record"] in saved.numbers}


def _rows(entries):
    """Key and name of each row of panels."""
    if not all(e.get("after_rad") for e in entries):
        return [("before_rad", "residual")]
    tall = [max(np.abs(e[key]).max() for e in entries) for key in ("before_rad", "after_rad")]
    rows = [("before_rad", "before"), ("after_rad", "after")]
    return rows if tall[0] < ZOOM * tall[1] else [*rows, ("after_rad", "after,\nown scale")]


def _residual(axes, entry, key):
    torque, direction = np.asarray(entry["torque_Nm"]), np.asarray(entry["direction"])
    angle = np.asarray(entry[key]) * ARCMIN_PER_RAD
    noise = entry["noise_rad"] * ARCMIN_PER_RAD
    axes.axhspan(-noise, noise, color=GREY, alpha=0.35, linewidth=0, label="noise, ±1 standard deviation")
    axes.axhline(0, color="black", linewidth=0.6)
    look = {"linestyle": "none", "markersize": 2.6, "markerfacecolor": "none", "markeredgewidth": 0.6}
    for sign, line, marker, name in ((1, RISING, "^", "rising torque"), (-1, FALLING, "o", "falling torque")):
        own = direction == sign
        axes.plot(torque[own], angle[own], marker=marker, color=line["color"], label=name, **look)
