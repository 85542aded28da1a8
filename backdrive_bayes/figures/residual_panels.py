"""Panels of residuals over torque, records in columns: shared by the figures of the diagnosis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.style import FALLING, GREY, RISING, TORQUE_TICKS, few_ticks
from backdrive_bayes.number_text import ARCMIN_PER_RAD

Curve = Callable[..., None]
"""Draws one direction: ``curve(axes, torque, angle, own, look, name)``, arrays (blocks,), angle in arcmin."""


def by_record(saved: Diagnosed) -> dict[int, dict]:
    """Residual objects by the number of their record."""
    found = saved.result.get("residual") or []
    return {saved.numbers[r["record"]]: r for r in found if r["record"] in saved.numbers}


def draw_panels(part, saved: Diagnosed, records: list[int], rows, curve: Curve, ticks: int) -> np.ndarray:
    """Axes (rows, records) with the noise band and ``curve`` of each direction; ``rows`` holds key and name of each row."""
    entries = by_record(saved)
    panels = part.subplots(len(rows), len(records), sharex="col", sharey="row", squeeze=False)
    for column, record in zip(panels.T, records, strict=True):
        for axes, (key, _) in zip(column, rows, strict=True):
            _panel(axes, entries[record], key, curve)
        column[0].set_title(saved.labels[record])
        column[-1].set_xlabel("torque [N·m]")
    for axes, (_, name) in zip(panels[:, 0], rows, strict=True):
        axes.set_ylabel(f"{name}\n[arcmin]")
    for axes in panels.ravel():
        few_ticks(axes, TORQUE_TICKS[len(records)], ticks)
    part.align_ylabels(panels[:, 0])
    return panels


def _panel(axes, entry, key, curve):
    torque, direction = np.asarray(entry["torque_Nm"]), np.asarray(entry["direction"])
    angle, noise = np.asarray(entry[key]) * ARCMIN_PER_RAD, entry["noise_rad"] * ARCMIN_PER_RAD
    axes.axhspan(-noise, noise, color=GREY, alpha=0.35, linewidth=0, label="noise, ±1 standard deviation")
    axes.axhline(0, color="black", linewidth=0.6)
    for sign, look, name in ((1, RISING, "rising torque"), (-1, FALLING, "falling torque")):
        curve(axes, torque, angle, direction == sign, look, name)
