"""Where the gap lies: torque × branch × record."""

from __future__ import annotations

import math
from typing import Any

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.style import BLUE, GREY, VERMILLION, few_ticks, matplotlib, new_figure, styled
from backdrive_bayes.number_text import ARCMIN_PER_RAD

CAPTION = (
    "Gap map: what the baseline leaves of the measured angle, over torque, for loading and unloading of every "
    "record. Colour: signed rms of measured minus modelled angle. Numbers: share of the whole gap in per cent, "
    "with the sign of the residual. A row is split where a branch was run more than once, the first on top. "
    "Hatched cells are not credibly different from zero; white: no data. Where amplitudes differ, torque is "
    "given as share of the record's amplitude."
)
MAP_IN = 5.2
"""Height of the cells of one map at most [inch]."""
_MAP = matplotlib.colors.LinearSegmentedColormap.from_list("gap", [BLUE, "#F7F7F7", VERMILLION])
_WAY = {"load+": (0, 1), "unload+": (1, 1), "load-": (0, -1), "unload-": (1, -1)}
"""Row within a record, and side of the torque axis."""
ROW_IN = (0.3, 0.19)
"""Height of a row and of a stripe in it, at least [inch]."""
UNEQUAL = 1.3
"""Amplitudes that differ by this factor do not share an axis in N·m."""
LEAST_IN = 1.15
"""Height of all rows together, at least [inch]."""
_WIDTH_IN = 4.9
_GAP = 0.22
"""Space between records in rows."""


def row_height_in(saved: Diagnosed, least: float, stripe: float, records: int = 99) -> float:
    """Height of a row [inch] in which the most often repeated branch still shows its cycles; more for few records."""
    most = max((len(c) for c in _cycles(saved).values()), default=1)
    return max(least, min(stripe * most, 4 * least), LEAST_IN / ((2 + _GAP) * records))


def fitting(height_in: float, row_in: float) -> int:
    """How many records fit into a height, two at least."""
    return max(2, int(height_in / ((2 + _GAP) * row_in)))


def _cycles(saved):
    """The cycles of each branch of each record."""
    found: dict[tuple, set] = {}
    for c in saved.cells:
        found.setdefault((c["record"], c["branch"]), set()).add(c["cycle"])
    return {key: sorted(c) for key, c in found.items()}


def draw(saved: Diagnosed, records: list[int]):
    """The map of some records as a figure of its own."""
    row_in = row_height_in(saved, *ROW_IN, len(records))
    with styled():
        figure = new_figure(1.2 + row_in * (2 + _GAP) * len(records))
        axes = figure.subplots()
        draw_map(axes, saved, records, row_in, numbers=True)
        add_key(axes)
    return figure


def draw_map(axes, saved: Diagnosed, records: list[int], row_in: float, numbers: bool) -> None:
    """Cells of ``records`` with their colour bar; rows are ``row_in`` inches high; shares are written with ``numbers``."""
    cells = [c for c in saved.cells if saved.numbers[c["record"]] in records]
    cycles = _cycles(saved)
    unit, factor = ("noise floors", 1 / saved.noise_rad) if saved.noise_rad else ("arcmin", ARCMIN_PER_RAD)
    sure = [abs(c["signed_rms_rad"]) for c in saved.cells if c.get("credible", True)]
    most = max(sure, default=0.0) * factor or 1.0
    norm = matplotlib.colors.Normalize(-most, most)
    scales, span, axis = _torque_scales(saved)
    for cell in cells:
        every = cycles[cell["record"], cell["branch"]]
        number = saved.numbers[cell["record"]]
        box = _box(cell, scales[number], _top(records, number), every)
        _cell(axes, cell, box, norm(cell["signed_rms_rad"] * factor), (span, row_in, numbers))
    axes.axvline(0, color="black", linewidth=0.7)
    axes.set_xlim(-1.01 * span, 1.01 * span)
    few_ticks(axes, 8, None)
    _rows(axes, saved, records)
    axes.set_xlabel(f"{axis}; loading runs away from zero, unloading back to zero")
    if sure:
        _bar(axes, norm, unit)


def _bar(axes, norm, unit):
    bar = axes.figure.colorbar(matplotlib.cm.ScalarMappable(norm, _MAP), ax=axes, fraction=0.05, pad=0.015)
    bar.set_label(f"signed rms\n[{unit}]")
    bar.locator = matplotlib.ticker.MaxNLocator(5, symmetric=True)
    bar.outline.set_linewidth(0.5)


def _top(records, record):
    return records.index(record) * (2 + _GAP)


def _torque_scales(saved):
    """Unit of torque of each record, the axis' end in it and its name: amplitudes that differ have an axis of shares."""
    tops = [r["amplitude_Nm"] for r in saved.records]
    scales, name = [1.0] * len(tops), "torque [N·m]"
    if max(tops) > UNEQUAL * min(tops):
        scales, name = tops, "torque / amplitude of the record"
    ends = [max(abs(c["torque_lo_Nm"]), abs(c["torque_hi_Nm"])) / scales[saved.numbers[c["record"]]] for c in saved.cells]
    return scales, max(ends), name


def _box(cell, scale, top, every):
    """Left, top, width and height of a cell in torque units and rows; the cycles of its branch are stripes of the row."""
    row, side = _WAY[cell["branch"]]
    ends = [cell["torque_lo_Nm"] / scale, cell["torque_hi_Nm"] / scale]
    lo, hi = sorted(ends if min(ends) < 0 < max(ends) else [side * abs(e) for e in ends])
    return lo, top + row + every.index(cell["cycle"]) / len(every), hi - lo, 1 / len(every)


def _cell(axes, cell, box, colour, drawn):
    span, row_in, numbers = drawn
    left, top, width, height = box
    sure = cell.get("credible", True)
    look: dict[str, Any] = {"facecolor": _MAP(colour)} if sure else {"facecolor": "#ECECEC", "hatch": "////"}
    edge = "white" if sure else "#B5B5B5"
    axes.add_patch(matplotlib.patches.Rectangle((left, top), width, height, edgecolor=edge, linewidth=0.5, **look))
    sign = "+" if cell["signed_rms_rad"] > 0 else "−"
    share = cell.get("share") or 0.0
    label = f"{sign}{100 * share:.0f}" if numbers and share >= 0.005 else sign
    room_in = width / (2 * span) * _WIDTH_IN
    label = label if room_in > 0.09 * len(label) + 0.02 else sign
    if sure and room_in > 0.1 and row_in * height > 0.12:
        ink = "white" if abs(colour - 0.5) > 0.33 else "black"
        axes.text(left + width / 2, top + height / 2, label, ha="center", va="center_baseline", color=ink, fontsize=8)


def _rows(axes, saved, records):
    """Names of the rows, one record after the other from the top."""
    at, names = [], []
    for record in records:
        top = _top(records, record)
        at += [top + 0.5, top + 1.5]
        names += [f"{saved.labels[record]}  loading", "unloading"]
    axes.set_yticks(at, names)
    axes.set_ylim(_top(records, records[-1]) + 2.02, -0.02)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)


def add_key(axes) -> None:
    """The legend for cells that may be zero, above the map at the right."""
    look: dict[str, Any] = {"facecolor": "#ECECEC", "edgecolor": GREY, "hatch": "////", "linewidth": 0.5}
    patch = matplotlib.patches.Patch(label="not credibly non-zero", **look)
    axes.legend(handles=[patch], loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0.1)


def heaviest(saved: Diagnosed, at_most: int) -> list[int]:
    """The records with the largest shares of the gap, in their own order."""
    shares = [math.fsum(c.get("share") or 0.0 for c in saved.cells if c["record"] == r["file"]) for r in saved.records]
    order = sorted(range(len(shares)), key=lambda i: -shares[i])
    return sorted(order[:at_most])
