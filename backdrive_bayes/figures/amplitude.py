"""Loop area and dissipation ratio of loops of smaller amplitude."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import MJ_PER_J, SERIES, few_ticks, legend_below, new_figure, record_labels, styled

CAPTION = (
    "Energy S(t) dissipated in a loop of amplitude t and dissipation ratio u(t) = S/W_abs: median and "
    "interval. Below the measured amplitude these are predictions."
)
PANELS = (("loop_area_J", MJ_PER_J, "S(t) [mJ]"), ("dissipation_ratio", 1.0, "u(t) [–]"))


def draw(saved: Saved, records: list[int]):
    """S(t) [mJ] and u(t) of the given records (at most six) over the amplitude t [N·m]."""
    with styled():
        figure = new_figure(2.35)
        axes = figure.subplots(1, 2)
        draw_panels(axes, saved, records, record_labels(saved.records))
        legend_below(figure, axes[0], columns=3)
    return figure


def draw_panels(axes, saved: Saved, records: list[int], labels: list[str]) -> None:
    """S(t) into the first of two axes and u(t) into the second."""
    for place, record in enumerate(records):
        for panel, (key, factor, _) in zip(axes, PANELS, strict=True):
            _series(panel, saved.records[record], key, factor, labels[record], place, len(records))
    for panel, (_, _, name) in zip(axes, PANELS, strict=True):
        panel.set(xlabel="amplitude t [N·m]", ylabel=name, xlim=(0, None), ylim=(0, None))
        few_ticks(panel, 5)


def _series(panel, record, key, factor, label, place, count):
    amplitude = np.asarray(record["by_amplitude"]["amplitude_Nm"])
    values = record["by_amplitude"][key]
    median, lo, hi = (factor * np.array([v[k] if v else np.nan for v in values]) for k in ("median", "lo", "hi"))
    # A small sideways step keeps the bars of several records apart.
    aside = (place - 0.5 * (count - 1)) * 0.12 * (amplitude[0] if amplitude.size else 0.0)
    error = np.maximum([median - lo, hi - median], 0.0)
    look = SERIES[place % len(SERIES)]
    panel.errorbar(amplitude + aside, median, error, **look, label=label, capsize=2, markersize=4, markerfacecolor="white")
