"""Corner plot of the physical parameters."""

from __future__ import annotations

import math
import warnings

import numpy as np

from backdrive_bayes.errors import MissingExtra
from backdrive_bayes.figures.saved import Saved
from backdrive_bayes.figures.style import (
    BLUE,
    WIDTH_IN,
    MaxNLocator,
    moved,
    new_figure,
    numbers,
    shown_unit,
    size_in,
    styled,
    two_lines,
    words,
)

CAPTION = (
    "Posterior of the physical parameters, functionals of the drawn operator: marginal histograms and pairwise contours that "
    "hold 39 % and 86 % of the draws (one and two standard deviations of a normal)."
)
MOST = 16
"""Parameters in one figure; more are spread evenly over several."""
LEVELS = tuple(1 - math.exp(-0.5 * deviations**2) for deviations in (1, 2))
"""What contours at one and two standard deviations of a normal in two dimensions hold."""
HEIGHT_IN = (0.95, 0.33, 6.9)
"""Height of what stands around the panels, of a panel, and of the whole figure at most [inch]."""
PAD_IN = 0.06
TICK_LINE_IN = 0.14
"""Height of a line of tick labels with the air that it needs."""
NAME_IN = 0.42
"""Height of a name above its panel."""


def shared_parameters(saved: Saved) -> dict[str, tuple[np.ndarray, str]]:
    """Draws (chains, draws) and unit for display of each parameter that belongs to no single record."""
    posterior, out = saved.group("posterior"), {}
    for name, about in saved.indicators["parameters"].items():
        if name in posterior and posterior[name].dims == ("chain", "draw"):
            values = posterior[name].values
            factor, unit = shown_unit(about["unit"], [np.quantile(np.abs(values), 0.95)])
            out[name] = values * factor, unit
    return out


def in_one_figure(parameters: int) -> int:
    """How many of so many parameters to show in one figure."""
    return -(-parameters // max(1, -(-parameters // MOST)))


def height_in(parameters: int) -> float:
    """Height of the figure of so many parameters [inch]; few parameters get wide panels."""
    below, panel, most = HEIGHT_IN
    return min(most, below + max(panel, 1.6 / parameters) * parameters)


def draw(saved: Saved, names: list[str]):
    """Corner plot of the named shared parameters (at most sixteen) in arcmin, mN·m or N·m."""
    corner = _corner()
    every = shared_parameters(saved)
    shown, n = {name: every[name] for name in names}, len(names)
    with styled():
        figure = new_figure(height_in(n), constrained=False)
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
        axes = np.array(figure.axes).reshape(n, n)
        _dress(axes, shown)
        _arrange(figure, axes)
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


def _dress(axes, shown):
    """At most two ticks a panel, and names in words with units above the diagonal."""
    line = TICK_LINE_IN * len(axes) / (height_in(len(axes)) - HEIGHT_IN[0])
    for i, (name, (_, unit)) in enumerate(shown.items()):
        text, last = two_lines(words(name), f"[{unit or '–'}]"), i == len(axes) - 1 and i > 0
        place = {"ha": "right" if last else "left", "va": "bottom", "transform": moved(axes[i, i], 0, PAD_IN)}
        axes[i, i].text(1.0 if last else 0.0, 1.0, text, **place)
        for j, panel in enumerate(axes[i, : i + 1]):
            panel.tick_params(length=2, pad=1.5)
            _ticks(panel.set_xticks, *panel.get_xlim(), line, i == len(axes) - 1)
            if j < i:
                _ticks(panel.set_yticks, *panel.get_ylim(), line, j == 0)
            for label in panel.get_xticklabels():
                label.set(rotation=90, ha="right", va="center", rotation_mode="anchor")
            for label in panel.get_yticklabels():
                label.set(rotation=0, ha="right", va="center")


def _ticks(put, lo, hi, line, labelled):
    at = _inner_ticks(lo, hi, line)
    put(at, numbers(at) if labelled else [""] * len(at))


def _inner_ticks(lo, hi, line):
    """Two round values well inside a panel, a line of text apart, or one: labels must not meet; ``line`` is a share of it."""
    inside = np.array([])
    for n in range(2, 13):
        ticks = MaxNLocator(n, steps=[1, 2, 5, 10]).tick_values(lo, hi)
        inside = ticks[(ticks > lo + 0.5 * line * (hi - lo)) & (ticks < hi - 0.5 * line * (hi - lo))]
        if inside.size >= 2 and inside[-1] - inside[0] >= line * (hi - lo):
            return inside[[0, -1]]
    return inside[inside.size // 2 :][:1]


def _arrange(figure, axes):
    """Margins that hold the longest tick labels, and the first name at the top."""
    ticks_x = max((size_in(t)[1] for panel in axes[-1] for t in panel.get_xticklabels()), default=0.0) + 2 * PAD_IN
    ticks_y = max((size_in(t)[0] for panel in axes[:, 0] for t in panel.get_yticklabels()), default=0.0) + 2 * PAD_IN
    height = height_in(len(axes))
    figure.subplots_adjust(ticks_y / WIDTH_IN, ticks_x / height, 0.99, 1 - NAME_IN / height, wspace=0.08, hspace=0.08)
