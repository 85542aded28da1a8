"""Rank plots of the shared parameters over independent ensembles, and the trace of the log posterior."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.corner_plot import shared_parameters
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import GREY, SERIES, few_ticks, new_figure, styled, words, wrapped

CAPTION = (
    "Sampling. Rank histograms: ranks of each ensemble's draws among all draws, as counts over the even "
    "share; ensembles that agree stay near 1. Below: log posterior of the kept draws of each ensemble, "
    "walker after walker."
)
BINS = 16
COLUMNS = 6
LETTERS = 12
"""What fits above a panel."""


def draw(saved: Saved):
    """Rank histograms in a grid and the trace of lp beneath them."""
    shown = shared_parameters(saved)
    rows = -(-len(shown) // COLUMNS)
    with styled():
        figure = new_figure(1.75 + 1.15 * rows)
        grid = figure.add_gridspec(rows + 1, COLUMNS, height_ratios=[*[1.0] * rows, 1.35])
        first = None
        for i, (name, (values, _)) in enumerate(shown.items()):
            panel = figure.add_subplot(grid[i // COLUMNS, i % COLUMNS], sharey=first)
            first = first or panel
            _ranks(panel, values)
            panel.set_title(wrapped(words(name), LETTERS), pad=3, fontsize=8)
            panel.tick_params(labelleft=i % COLUMNS == 0, labelbottom=i + COLUMNS >= len(shown))
            if i % COLUMNS == 0:
                panel.set_ylabel("count /\neven share")
            if i + COLUMNS >= len(shown):
                panel.set_xlabel("rank / draws", labelpad=1)
        first.set_ylim(0, max(2.0, first.get_ylim()[1]))
        _trace(figure.add_subplot(grid[rows, :]), saved.group("sample_stats")["lp"].values)
    return figure


def _ranks(panel, values):
    ranks = np.argsort(np.argsort(values.ravel(), kind="stable"), kind="stable").reshape(values.shape)
    share = (ranks + 0.5) / values.size
    panel.axhline(1.0, color=GREY, linewidth=0.8)
    for chain, own in enumerate(share):
        counts, edges = np.histogram(own, bins=BINS, range=(0, 1))
        look = SERIES[chain % len(SERIES)]
        panel.stairs(
            counts * BINS / own.size,
            edges,
            color=look["color"],
            linestyle=look["linestyle"],
            linewidth=1,
            baseline=None,
        )
    few_ticks(panel, 2, 2)


def _trace(panel, lp):
    for chain, own in enumerate(lp):
        look = SERIES[chain % len(SERIES)]
        panel.plot(
            own,
            linestyle="none",
            marker=look["marker"],
            markersize=1.8,
            markeredgewidth=0.4,
            markerfacecolor="none",
            color=look["color"],
            label=f"ensemble {chain + 1}",
        )
    panel.set(xlabel="kept draw, walker after walker", ylabel="log posterior", xlim=(0, lp.shape[1]))
    few_ticks(panel, 6, 4)
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.42), ncols=min(6, len(lp)), markerscale=2.5)
