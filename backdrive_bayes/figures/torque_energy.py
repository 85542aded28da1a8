"""The torque–energy curve with its band and the ranges W1, W2 and W3."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import BLACK, BLUE, MJ_PER_J, few_ticks, legend_below, new_figure, record_labels, styled
from backdrive_bayes.number_text import significant

CAPTION = (
    "Torque–energy curve: energy dissipated per unit of torque, median and interval, with the ranges W1 "
    "(|τ| ≤ τ₁), W2 (τ₁ < |τ| ≤ τ₂) and W3 (beyond τ₂, up to the amplitude also where only low torques are shown)."
)
ZOOM_BELOW = 0.25
"""Where τ₂ lies below this share of the amplitude, the panel shows the low torques only."""
ZOOM_TAU2 = 3.0
SHADES = (("W1", "#9A9A9A", "////"), ("W2", "#CFCFCF", ""), ("W3", "#F2F2F2", ""))


def draw(saved: Saved, records: list[int]):
    """Curves of the given records in columns, mJ per N·m over |torque| [N·m]."""
    with styled():
        figure = new_figure(2.4)
        axes = figure.subplots(1, len(records), sharey=True, squeeze=False)[0]
        labels = record_labels(saved.records)
        for panel, record in zip(axes, records, strict=True):
            tau1, tau2 = _tau(saved, record)
            enlarged = draw_curve(panel, saved, record)
            panel.set_title(f"{labels[record]}\nτ₁ {significant(tau1, 2)}, τ₂ {significant(tau2, 2)} N·m")
            panel.set_xlabel("low |torque| [N·m]" if enlarged else "|torque| [N·m]")
        axes[0].set_ylabel("energy per torque\n[mJ/(N·m)]")
        legend_below(figure, axes[0], columns=9)
    return figure


def draw_curve(panel, saved: Saved, record: int) -> bool:
    """Draw the curve of one record; returns whether only low torques are shown."""
    tau2 = _tau(saved, record)[1]
    enlarged = tau2 < ZOOM_BELOW * saved.records[record]["amplitude_Nm"]
    _curve(panel, saved, record, enlarged)
    return bool(enlarged)


def _tau(saved, record):
    curve = saved.records[record]["torque_energy"]
    return [(curve[key] or {"median": np.nan})["median"] for key in ("tau1_Nm", "tau2_Nm")]


def _curve(axes, saved, record, zoomed):
    curve = saved.records[record]["torque_energy"]
    # Amplitudes that agree to three digits get the same scale and ticks.
    torque, end = np.asarray(curve["torque_Nm"]), float(f"{saved.records[record]['amplitude_Nm']:.3g}")
    tau1, tau2 = _tau(saved, record)
    lo, hi, median = (np.asarray(curve[k]) * MJ_PER_J for k in ("lo", "hi", "median_J_per_Nm"))
    edges = (0.0, tau1, tau2, end)
    for (name, colour, hatch), a, b in zip(SHADES, edges, edges[1:], strict=False):
        axes.axvspan(a, b, facecolor=colour, hatch=hatch, edgecolor="white", linewidth=0, alpha=0.8, label=name)
    band = f"{100 * saved.indicators['level']:.3g} % interval"
    axes.fill_between(torque, lo, hi, color=BLUE, alpha=0.4, linewidth=0, label=band)
    axes.plot(torque, median, color=BLUE, label="median")
    axes.axvline(tau1, color=BLACK, linestyle=(0, (1, 1.2)), linewidth=1, label="τ₁")
    axes.axvline(tau2, color=BLACK, linestyle=(0, (5, 2)), linewidth=1, label="τ₂")
    axes.set_xlim(0, min(end, ZOOM_TAU2 * tau2) if zoomed else end)
    axes.set_ylim(0, None)
    few_ticks(axes, 3 if zoomed else 2)
