"""Traces of the sampled log scales and of their log posterior density."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import SERIES, few_ticks, legend_below, new_figure, styled, words, wrapped

CAPTION = (
    "Sampling. Natural logarithms of the scales of the class's weights, and log of their marginal posterior density, over the "
    "kept draws of each independent ensemble, walker after walker. Ensembles that agree cover the same range."
)
PREFIX = "log_scale_"
FIXED = 1e-9
"""Standard deviation below which a scale was held fixed, as those of effects at trace level are."""
COLUMNS = 3
LETTERS = 30
"""What fits above a panel."""


def log_scales(saved: Saved) -> dict[str, np.ndarray]:
    """Draws (chains, draws) of every log scale that was sampled, by name."""
    posterior = saved.group("posterior")
    found = {str(n).removeprefix(PREFIX): v.values for n, v in posterior.items() if str(n).startswith(PREFIX)}
    return {n: v for n, v in found.items() if v.std() > FIXED}


def draw(saved: Saved):
    """One panel a log scale, and one for the log density."""
    shown = {f"log scale of {words(n)}": v for n, v in log_scales(saved).items()}
    shown["log posterior density"] = saved.group("sample_stats")["lp"].values
    rows = -(-len(shown) // COLUMNS)
    with styled():
        figure = new_figure(0.5 + 0.78 * rows)
        grid = figure.add_gridspec(rows, COLUMNS)
        for i, (name, values) in enumerate(shown.items()):
            panel = figure.add_subplot(grid[i // COLUMNS, i % COLUMNS])
            _trace(panel, values)
            panel.set_title(wrapped(name, LETTERS), pad=3, fontsize=8)
            last = i + COLUMNS >= len(shown)
            panel.tick_params(labelbottom=last)
            if last:
                panel.set_xlabel("kept draw")
        legend_below(figure, panel, columns=6, markerscale=2.5)
    return figure


def _trace(panel, values):
    for chain, own in enumerate(values):
        look = SERIES[chain % len(SERIES)]
        marks = {"marker": look["marker"], "markersize": 1.6, "markeredgewidth": 0.4, "markerfacecolor": "none"}
        panel.plot(own, linestyle="none", color=look["color"], label=f"ensemble {chain + 1}", **marks)
    panel.set_xlim(0, values.shape[1])
    few_ticks(panel, 4, 3)
