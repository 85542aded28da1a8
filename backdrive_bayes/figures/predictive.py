"""Posterior predictive check: measured blocks against replicated ones."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.saved import Saved, record_blocks
from backdrive_bayes.figures.style import (
    BLACK,
    BLUE,
    GREY,
    few_ticks,
    legend_below,
    new_figure,
    record_labels,
    styled,
)
from backdrive_bayes.number_text import ARCMIN_PER_RAD

CAPTION = (
    "Posterior predictive check. Left: distribution of the measured blocks' ranks among replicated blocks, "
    "as difference from an even spread; the band holds the same curve of the replicates themselves. Middle "
    "and right: two summaries of the measured record (line) among those of the replicates (histogram); the "
    "rms step of the residual from block to block tests the noise level. Replicates may be wider than the "
    "measurement: the posterior follows the measured record and takes part of its noise along, while each "
    "replicate has fresh noise. Ranks then crowd in the middle (the curve falls, then rises) and the line lies "
    "left of the histogram: cautious. The opposite means model discrepancy."
)


def draw(saved: Saved, records: list[int]):
    """One row a record: rank distribution, angle range and rms step of the residual [arcmin]."""
    with styled():
        figure = new_figure(0.7 + 1.3 * len(records))
        axes = figure.subplots(len(records), 3, squeeze=False)
        labels = record_labels(saved.records)
        for row, record in zip(axes, records, strict=True):
            blocks = record_blocks(saved, record)
            _ecdf(row[0], blocks, saved.indicators["level"])
            row[0].set_ylabel("Δ share")
            row[1].set_title(labels[record])
            replicates = blocks.replicates_rad
            _summary(row[1], np.ptp(replicates, axis=1), np.ptp(blocks.angle_rad))
            _summary(row[2], _roughness(replicates, blocks), _roughness(blocks.angle_rad, blocks))
        axes[-1, 0].set_xlabel("rank among replicates")
        axes[-1, 1].set_xlabel("angle range [arcmin]")
        axes[-1, 2].set_xlabel("rms step [arcmin]")
        legend_below(figure, *axes[0, :2], columns=4)
    return figure


def _ecdf(panel, blocks, level):
    """Empirical distribution of ranks minus the even one, for the measured record and for every replicate."""
    replicates = np.sort(blocks.replicates_rad, axis=0)
    grid = np.linspace(0, 1, 101)
    measured = _curve(_rank(replicates, blocks.angle_rad), grid)
    band = np.array([_curve(_rank(replicates, r), grid) for r in blocks.replicates_rad])
    lo, hi = np.quantile(band, [0.5 - level / 2, 0.5 + level / 2], axis=0)
    panel.fill_between(grid, lo, hi, color=GREY, alpha=0.4, linewidth=0, label=f"ranks of replicates, {100 * level:.3g} %")
    panel.plot(grid, measured, color=BLUE, label="ranks of measured")
    panel.axhline(0, color=BLACK, linewidth=0.6)
    panel.set_xlim(0, 1)
    few_ticks(panel)


def _rank(ordered, angle):
    return (ordered < angle).mean(axis=0) + 0.5 * (ordered == angle).mean(axis=0)


def _curve(ranks, grid):
    return np.searchsorted(np.sort(ranks), grid, side="right") / ranks.size - grid


def _roughness(angle, blocks):
    """Root mean square difference of neighbouring residuals on the same leg, shape (…,)."""
    same = np.diff(blocks.leg) == 0
    return np.sqrt(np.mean(np.diff(angle - blocks.predicted_rad, axis=-1)[..., same] ** 2, axis=-1))


def _summary(panel, replicated, measured):
    look = {"color": "#C9C9C9", "edgecolor": "#7A7A7A", "linewidth": 0.4}
    panel.hist(replicated * ARCMIN_PER_RAD, bins=20, label="replicates", **look)
    panel.axvline(measured * ARCMIN_PER_RAD, color=BLUE, linewidth=1.6, label="measured record")
    few_ticks(panel, 3)
    panel.set_ylabel("count")
