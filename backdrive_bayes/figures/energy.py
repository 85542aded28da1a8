"""Where and at which amplitudes a reducer dissipates energy, at a glance."""

from __future__ import annotations

from backdrive_bayes.figures import amplitude, torque_energy
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import SERIES, few_ticks, new_figure, record_labels, styled

CAPTION = (
    "Left: torque–energy curve of one record, energy dissipated per unit of torque with the ranges W1 (|τ| ≤ τ₁), W2 (up to τ₂) "
    "and W3. Middle and right: energy S(t) of a loop of amplitude t and dissipation ratio u(t), predicted below the measured "
    "amplitude. Shown are median and interval."
)


def draw(saved: Saved):
    """Torque–energy curve of the main record, and S(t) and u(t) of up to six records."""
    labels, main = record_labels(saved.records), saved.main_record
    with styled():
        figure = new_figure(2.3)
        left, *axes = figure.subplots(1, 3, width_ratios=[1.15, 1, 1])
        low = "low " if torque_energy.draw_curve(left, saved, main) else ""
        left.set(title=labels[main], xlabel=f"{low}|torque| [N·m]", ylabel="energy per torque\n[mJ/(N·m)]")
        few_ticks(left, 3)
        shown = list(range(min(len(labels), len(SERIES))))
        amplitude.draw_panels(axes, saved, shown, labels)
        for panel in axes:
            few_ticks(panel, 3)
        handles, names = axes[0].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower right", ncols=2 if len(names) > 2 else 1)
        ranges = [p for p in zip(*left.get_legend_handles_labels(), strict=True) if p[1] in ("W1", "W2", "W3", "τ₁", "τ₂")]
        figure.legend([h for h, _ in ranges], [n for _, n in ranges], loc="outside lower left", ncols=3)
    return figure
