"""What is left over along the loop, before and after the effect is added."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.residual_panels import by_record, draw_panels
from backdrive_bayes.figures.style import RISING, legend_below, new_figure, styled

CAPTION = (
    "Measured minus modelled angle along the loop, before (baseline alone, or the simulator as it is) and after the chosen "
    "effect is added; little that is left is shown once more on its own scale. The first loading, which is not fitted, is left "
    "out."
)
ZOOM = 3.0
"""Where the residual shrinks by this factor, what is left gets a row with a scale of its own."""


def draw(saved: Diagnosed, records: list[int]):
    """Residuals [arcmin] over torque [N·m] of the given records in columns: before on top, after beneath.

    Where little is left, what is left is shown once more on its own scale.
    """
    entries = by_record(saved)
    rows = _rows([entries[r] for r in records]) if saved.added else [("before_rad", "residual")]
    with styled():
        figure = new_figure(0.85 + 1.05 * len(rows))
        axes = draw_panels(figure, saved, records, rows, _points, 5)
        if len(rows) > 1:
            axes[1, 0].set_ylim(axes[0, 0].get_ylim())
        legend_below(figure, axes[0, 0], columns=3, markerscale=1.8)
    return figure


def _rows(entries):
    """Key and name of each row of panels."""
    if not all(e.get("after_rad") for e in entries):
        return [("before_rad", "residual")]
    tall = [max(np.abs(e[key]).max() for e in entries) for key in ("before_rad", "after_rad")]
    rows = [("before_rad", "before"), ("after_rad", "after")]
    return rows if tall[0] < ZOOM * tall[1] else [*rows, ("after_rad", "after,\nown scale")]


def _points(axes, torque, angle, own, look, name):
    shape = {"linestyle": "none", "markersize": 2.6, "markerfacecolor": "none", "markeredgewidth": 0.6}
    marker = "^" if look is RISING else "o"
    axes.plot(torque[own], angle[own], marker=marker, color=look["color"], label=name, **shape)
