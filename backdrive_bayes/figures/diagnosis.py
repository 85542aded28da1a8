"""A diagnosis at a glance, and all its figures."""

from __future__ import annotations

import textwrap
from functools import partial
from typing import Any

from backdrive_bayes.figures import (
    diagnosis_closed,
    diagnosis_map,
    diagnosis_residual,
    diagnosis_shift,
    diagnosis_simulated,
    residual_panels,
)
from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_which import bar_lines, draw_bars
from backdrive_bayes.figures.diagnosis_words import answer_words
from backdrive_bayes.figures.fonts import drawable
from backdrive_bayes.figures.style import PER_FIGURE, Figure, new_figure, numbered, settled, styled

CAPTION = (
    "The diagnosis at a glance. Left: probability of each cause. Right: rms of the gap on held-out data before "
    "and after the effect is added, and the fraction closed. Beneath: where the baseline (or the simulator) misses "
    "the measurement (+: measured angle larger than modelled); with many records, those that hold most of the gap."
)
CAPTIONS = {
    "diagnosis": CAPTION,
    "gap-map": diagnosis_map.CAPTION,
    "gap-residual": diagnosis_residual.CAPTION,
    "closed-fraction": diagnosis_closed.CAPTION,
    "parameter-shift": diagnosis_shift.CAPTION,
    "simulator": diagnosis_simulated.CAPTION,
}
ROW_IN = (0.19, 0.14)
"""Height of a row of the map at a glance and of a stripe in it, at least [inch]."""
MAP_IN = 2.6
"""Height of the map at a glance, at most [inch]."""
_LINE = 104


def figures_of(saved: Diagnosed, wanted=lambda name: True) -> dict[str, Figure]:
    """Every figure that the saved parts allow, as far as ``wanted`` by name."""
    everything = list(range(len(saved.records)))
    makers = {"diagnosis": partial(draw, saved)} if saved.result["which"] or saved.cells else {}
    if saved.cells:
        row_in = diagnosis_map.row_height_in(saved, *diagnosis_map.ROW_IN)
        makers |= numbered("gap-map", diagnosis_map.draw, saved, everything, diagnosis_map.fitting(diagnosis_map.MAP_IN, row_in))
    residual = sorted(residual_panels.by_record(saved))
    makers |= numbered("gap-residual", diagnosis_residual.draw, saved, residual, PER_FIGURE)
    if saved.shrink:
        makers |= numbered("closed-fraction", diagnosis_closed.draw, saved, everything, diagnosis_closed.AT_MOST)
    if saved.shifts:
        makers["parameter-shift"] = partial(diagnosis_shift.draw, saved)
    if saved.simulator.get("told") and not saved.inconclusive:
        makers["simulator"] = partial(diagnosis_simulated.draw, saved)
    return settled({name: make() for name, make in makers.items() if wanted(name)})


def draw(saved: Diagnosed):
    """Answer and place in words; probabilities; before and after; gap map."""
    records = mapped(saved)
    row_in = diagnosis_map.row_height_in(saved, *ROW_IN, len(records))
    lines = textwrap.wrap(drawable(saved.inconclusive or saved.summary, 3 * _LINE - 6), _LINE)
    held = len(diagnosis_closed.rows(saved, records)) if saved.added else 0
    heights = (
        0.32 + 0.17 * len(lines),
        max(1.8, 0.85 + 0.19 * bar_lines(saved), 1.0 + 0.22 * held),
        0.85 + row_in * 2.22 * len(records) if saved.cells else 0.5,
    )
    with styled():
        figure = new_figure(sum(heights))
        parts: Any = figure.subfigures(3, 1, height_ratios=heights)
        head, upper, lower = parts
        _head(head, heights[0], drawable(answer_words(saved), 80), lines)
        which, closed = upper.subplots(1, 2, width_ratios=[1.1, 1])
        _which(which, saved)
        _closed(upper, closed, saved, records)
        _where(lower.subplots(), saved, records, row_in)
    return figure


def mapped(saved: Diagnosed) -> list[int]:
    """The records that the map at a glance has room for."""
    return diagnosis_map.heaviest(saved, diagnosis_map.fitting(MAP_IN, diagnosis_map.row_height_in(saved, *ROW_IN)))


def _head(part, height, answer, lines):
    part.text(0.008, 1 - 0.05 / height, answer, va="top", fontsize=12, fontweight="bold")
    part.text(0.008, 1 - 0.29 / height, "\n".join(lines), va="top", fontsize=8.5, linespacing=1.25)


def _which(axes, saved):
    if saved.result["which"]:
        draw_bars(axes, saved)
    else:
        _absent(axes, "Which effect?", "no probabilities were found")


def _closed(part, axes, saved, records):
    if not saved.added:
        inside = "part of the model class:\nnothing is added that could close it"
        return _absent(axes, "How far does it close?", inside if saved.inside else "no effect was added to the model")
    diagnosis_closed.draw_before_after(axes, saved, records)
    if saved.effects == ["unknown"]:
        axes.set_title("How far with the best?", loc="left", fontweight="bold")
    tight = {"handletextpad": 0.4, "columnspacing": 1.2, "borderaxespad": 0.1}
    part.legend(handles=diagnosis_closed.before_after_handles(), loc="outside lower right", ncols=3, **tight)


def _where(axes, saved, records, row_in):
    if not saved.cells:
        return _absent(axes, "Where?", "no gap map was saved")
    diagnosis_map.draw_map(axes, saved, records, row_in, numbers=False)
    some = f" ({len(records)} of {len(saved.records)} records)" if len(records) < len(saved.records) else ""
    axes.set_title(f"Where?{some}", loc="left", fontweight="bold")
    diagnosis_map.add_key(axes)


def _absent(axes, title, text):
    axes.set_axis_off()
    axes.set_title(title, loc="left", fontweight="bold")
    axes.text(0, 0.8, text, transform=axes.transAxes, va="top")
