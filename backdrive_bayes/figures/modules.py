"""The settled loop taken apart: what each module and the effects contribute."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import (
    FALLING,
    RISING,
    few_ticks,
    legend_below,
    new_figure,
    record_labels,
    styled,
    words,
)
from backdrive_bayes.number_text import ARCMIN_PER_RAD, plain

CAPTION = (
    "The settled loop as the sum of its modules (median curves) and of the effects, which are the loop minus the sum of the "
    "modules and are left out where they span less than 2 % of it. What slipping elements turn in the mean of both branches is "
    "elastic. Panels share the loop's angle scale unless they say otherwise."
)
COLUMNS = 5
"""The loop, three modules and the effects beside each other; the modules of other packages go into more rows."""
VISIBLE = 0.02
"""Effects that span less than this share of the loop's range have no panel."""
LEGIBLE = 0.1
"""Panels that span less than this share of the loop's range get a scale of their own."""
ALIKE = 0.03
"""Records whose loops agree to this share of the peak angle are shown once."""


def distinct(saved: Saved) -> list[int]:
    """Records whose module curves differ visibly from those before them, the main one first."""
    kept: list[int] = []
    main = saved.main_record
    for i in [main, *(i for i in range(len(saved.records)) if i != main)]:
        if not any(_alike(saved.records[i], saved.records[j]) for j in kept):
            kept.append(i)
    return kept


def _alike(a, b):
    if a["modules"].keys() != b["modules"].keys() or len(a["loop"]["torque_Nm"]) != len(b["loop"]["torque_Nm"]):
        return False
    pairs = [(a["loop"]["torque_Nm"], b["loop"]["torque_Nm"])]
    pairs += [(a["modules"][m][k], b["modules"][m][k]) for m in a["modules"] for k in ("rising_rad", "falling_rad")]
    top = max(np.abs(a["loop"]["rising_rad"]["median"]))
    scales = [max(np.abs(a["loop"]["torque_Nm"])), *[top] * (len(pairs) - 1)]
    return all(np.abs(np.subtract(x, y)).max() < ALIKE * s for (x, y), s in zip(pairs, scales, strict=True))


def draw(saved: Saved, records: list[int]):
    """Panels for the loop, each module and the effects of the first of ``records``, angle [arcmin] over torque [N·m]."""
    record = saved.records[records[0]]
    curves = _curves(record)
    rows = -(-len(curves) // COLUMNS)
    with styled():
        figure = new_figure(0.55 + 1.4 * rows)
        axes = figure.subplots(rows, min(COLUMNS, len(curves)), sharex=True, squeeze=False).ravel()
        for panel, (name, rising, falling) in zip(axes, curves, strict=False):
            torque = record["loop"]["torque_Nm"]
            panel.plot(torque, np.multiply(rising, ARCMIN_PER_RAD), **RISING, label="rising torque")
            panel.plot(torque, np.multiply(falling, ARCMIN_PER_RAD), **FALLING, label="falling torque")
            panel.set_title(name)
            few_ticks(panel, None)
            _three_ticks(panel, float(np.max(np.abs(torque))))
            panel.tick_params(labelbottom=True)
            panel.set_xlabel("torque [N·m]")
        _scales(axes, curves)
        _label(figure, axes, len(curves))
        figure.suptitle(f"record {record_labels(saved.records)[records[0]]}", fontsize=8.5)
    return figure


def _curves(record):
    loop = [np.asarray(record["loop"][k]["median"]) for k in ("rising_rad", "falling_rad")]
    modules = {m: [np.asarray(c[k]) for k in ("rising_rad", "falling_rad")] for m, c in record["modules"].items()}
    rest = [whole - sum(parts[i] for parts in modules.values()) for i, whole in enumerate(loop)]
    seen = max(np.ptp(r) for r in rest) >= VISIBLE * max(np.ptp(b) for b in loop)
    effects = [("effects", *rest)] if seen else []
    return [("settled loop", *loop), *((words(m), *c) for m, c in modules.items()), *effects]


def _three_ticks(panel, largest):
    """Zero and the largest torque of one digit within the loop, to either side: panels are narrow."""
    power = 10.0 ** np.floor(np.log10(largest))
    at = float(np.floor(largest / power * (1.0 + 1e-9)) * power)
    panel.set_xticks([-at, 0.0, at], [f"−{plain(at)}", "0", plain(at)])


def _scales(axes, curves):
    """The loop's scale for every panel that would still be legible on it."""
    whole = max(np.ptp(curves[0][1]), np.ptp(curves[0][2]))
    for panel, (name, *branches) in zip(axes, curves, strict=False):
        if max(np.ptp(b) for b in branches) < LEGIBLE * whole:
            panel.set_title(f"{name}\n(own scale)")
        else:
            panel.set_ylim(axes[0].get_ylim())


def _label(figure, axes, used):
    for i, panel in enumerate(axes):
        if i >= used:
            panel.set_axis_off()
        elif i % COLUMNS == 0:
            panel.set_ylabel("angle [arcmin]")
    if used < len(axes):
        axes[-1].legend(*axes[0].get_legend_handles_labels(), loc="center")
    else:
        legend_below(figure, axes[0], columns=2)
