"""Measured blocks, settled loop with its band, and what is left over beneath it."""

from __future__ import annotations

from backdrive_bayes.figures.saved import Saved, record_blocks
from backdrive_bayes.figures.style import (
    FALLING,
    FIRST,
    GREY,
    RISING,
    TORQUE_TICKS,
    few_ticks,
    legend_below,
    new_figure,
    record_labels,
    styled,
)
from backdrive_bayes.number_text import ARCMIN_PER_RAD

CAPTION = (
    "Measured angle against torque (block means, encoder offset removed) with the reducer's settled loop: "
    "median and interval. Beneath: measured minus predicted angle; grey bars span the interval of "
    "replicated data. The first loading hangs on what was before it, is not fitted and has none."
)


def draw(saved: Saved, records: list[int]):
    """Loops of the given records in columns, angle [arcmin] over torque [N·m], residual strips beneath."""
    with styled():
        figure = new_figure(3.35)
        ratios = [3, 1.15] if saved.posterior_file else [1]
        axes = figure.subplots(len(ratios), len(records), sharex="col", sharey="row", squeeze=False, height_ratios=ratios)
        labels = record_labels(saved.records)
        for column, record in enumerate(records):
            _loop(axes[0, column], saved, record)
            axes[0, column].set_title(labels[record])
            axes[-1, column].set_xlabel("torque [N·m]")
            few_ticks(axes[0, column], TORQUE_TICKS[len(records)])
            if saved.posterior_file:
                few_ticks(axes[1, column], TORQUE_TICKS[len(records)], 4)
                _residual(axes[1, column], saved, record)
                axes[1, 0].set_ylabel("residual\n[arcmin]")
        axes[0, 0].set_ylabel("angle [arcmin]")
        figure.align_ylabels(axes[:, 0])
        legend_below(figure, axes[0, 0], columns=3, markerscale=1.8)
    return figure


def _kinds(blocks):
    """Name, mask and look of the three kinds of measured blocks."""
    rising, falling = blocks.direction > 0, blocks.direction < 0
    return (
        ("first loading", blocks.first, FIRST["color"], "x"),
        ("rising torque", rising & ~blocks.first, RISING["color"], "^"),
        ("falling torque", falling & ~blocks.first, FALLING["color"], "o"),
    )


def _loop(axes, saved, record):
    loop = saved.records[record]["loop"]
    level = saved.indicators["level"]
    if saved.posterior_file:
        blocks = record_blocks(saved, record)
        for name, mask, colour, marker in _kinds(blocks):
            if mask.any():
                _points(axes, blocks.torque_nm[mask], blocks.angle_rad[mask], colour, marker, f"measured, {name}")
    for key, look, name in (("rising_rad", RISING, "rising"), ("falling_rad", FALLING, "falling")):
        band = {k: [v * ARCMIN_PER_RAD for v in values] for k, values in loop[key].items()}
        axes.fill_between(loop["torque_Nm"], band["lo"], band["hi"], color=look["color"], alpha=0.3, linewidth=0)
        axes.plot(loop["torque_Nm"], band["median"], **look, label=f"settled loop, {name} ({100 * level:.3g} %)")


def _residual(axes, saved, record):
    blocks = record_blocks(saved, record)
    lo, hi = blocks.residual_band_rad(saved.indicators["level"]) * ARCMIN_PER_RAD
    fitted = ~blocks.first
    axes.vlines(blocks.torque_nm[fitted], lo[fitted], hi[fitted], color=GREY, alpha=0.35, linewidth=1.0)
    for _, mask, colour, marker in _kinds(blocks)[1:]:
        _points(axes, blocks.torque_nm[mask], blocks.residual_rad[mask], colour, marker, None)
    axes.axhline(0, color="black", linewidth=0.6)


def _points(axes, torque, angle_rad, colour, marker, label):
    look = {"linestyle": "none", "markersize": 2.4, "markerfacecolor": "none", "markeredgewidth": 0.5}
    axes.plot(torque, angle_rad * ARCMIN_PER_RAD, marker=marker, color=colour, label=label, **look)
