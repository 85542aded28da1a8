"""Corner plot of the shared parameters."""

from __future__ import annotations

import warnings

import numpy as np

from backdrive_bayes.errors import MissingExtra
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import BLUE, MaxNLocator, display_unit, new_figure, styled, words

CAPTION = (
    "Posterior of the parameters that all records share: marginal histograms and pairwise contours that "
    "hold 39 % and 86 % of the draws (one and two standard deviations of a normal)."
)
MOST = 12
LEVELS = (0.393, 0.865)
LABEL_IN = 0.45
"""Room for tick labels between a panel and its name [inch]."""


def shared_parameters(saved: Saved) -> dict[str, tuple[np.ndarray, str]]:
    """Draws (chains, draws) and unit for display of each parameter that belongs to no single record, at most
    twelve.
    """
    posterior, out = saved.group("posterior"), {}
    for name, about in saved.indicators["parameters"].items():
        if name in posterior and posterior[name].dims == ("chain", "draw") and len(out) < MOST:
            factor, unit = display_unit(about["unit"])
            values = posterior[name].values * factor
            if unit == "N·m" and np.median(np.abs(values)) < 0.1:
                values, unit = values * 1e3, "mN·m"
            out[name] = values, unit
    return out


def draw(saved: Saved):
    """Corner plot of at most twelve shared parameters in arcmin, mN·m or N·m."""
    corner = _corner()
    shown = shared_parameters(saved)
    n = len(shown)
    with styled():
        figure = new_figure(6.9, constrained=False)
        draws = np.stack([v.ravel() for v, _ in shown.values()], axis=1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            corner.corner(
                draws,
                fig=figure,
                bins=24,
                levels=LEVELS,
                range=[_span(column) for column in draws.T],
                smooth=1.0,
                color=BLUE,
                plot_datapoints=False,
                plot_density=False,
                fill_contours=True,
                labels=[""] * n,
            )
        _dress(np.array(figure.axes).reshape(n, n), shown, LABEL_IN * n / 5.2)
        figure.subplots_adjust(left=0.215, bottom=0.205, right=0.99, top=0.99, wspace=0.08, hspace=0.08)
    return figure


def _corner():
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import corner
    except ImportError:
        raise MissingExtra("the corner plot", "corner", "figures") from None
    return corner


def _span(values):
    lo, hi = np.quantile(values, [0.001, 0.999])
    margin = 0.05 * (hi - lo) or 0.5 * abs(hi) or 0.5
    return lo - margin, hi + margin


def _dress(axes, shown, label_at):
    """Two ticks a panel, and names in words with units at the left of each row and below each column."""
    for i, (name, (_, unit)) in enumerate(shown.items()):
        text = _name(name, unit)
        axes[-1, i].set_xlabel(text, rotation=90, ha="center", va="top")
        axes[-1, i].xaxis.set_label_coords(0.5, -label_at)
        axes[i, 0].set_ylabel(text, rotation=0, ha="right", va="center")
        axes[i, 0].yaxis.set_label_coords(-label_at if i else -0.1, 0.5)
        for j, panel in enumerate(axes[i, : i + 1]):
            panel.tick_params(length=2, pad=1.5)
            panel.tick_params(axis="x", labelrotation=90)
            panel.tick_params(axis="y", labelrotation=0)
            panel.set_xticks(_inner_ticks(*panel.get_xlim()))
            for label in (*panel.get_xticklabels(), *panel.get_yticklabels()):
                label.set(
                    ha="right" if label in panel.get_yticklabels() else "center", rotation_mode="default"
                )
            if j < i:
                panel.set_yticks(_inner_ticks(*panel.get_ylim()))


def _inner_ticks(lo, hi):
    """Two round values well inside a panel, so that labels of neighbours do not meet."""
    margin = 0.12 * (hi - lo)
    for n in range(2, 9):
        ticks = MaxNLocator(n, steps=[1, 2, 5, 10]).tick_values(lo, hi)
        inside = ticks[(ticks > lo + margin) & (ticks < hi - margin)]
        if inside.size >= 2:
            break
    return inside[[0, -1]]


def _name(name, unit):
    """Two lines, which is what fits beside a panel; the unit closes the second."""
    *first, last = words(name).split(" ")
    unit = f"[{unit or '–'}]"
    return f"{' '.join(first)}\n{last} {unit}" if first else f"{last}\n{unit}"
