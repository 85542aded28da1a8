"""How the baseline's parameters move once the effect is added."""

from __future__ import annotations

from statistics import NormalDist

from backdrive_bayes.figures.diagnosis_saved import Diagnosed
from backdrive_bayes.figures.diagnosis_words import FAR, parameter_words, signed
from backdrive_bayes.figures.fonts import drawable
from backdrive_bayes.figures.style import BLUE, VERMILLION, few_ticks, legend_below, new_figure, styled

CAPTION = (
    "Shift of the baseline's parameters when the effect is added, in each parameter's own standard deviations "
    "(zero: median before; beyond ±1000 at the edge). Open circles and dashed lines: median and interval before; "
    "filled squares: after. A parameter that moves by several deviations had been standing in for the missing effect."
)
AT_MOST = 14
WIDE = 12.0
"""Shifts beyond this many standard deviations need a scale that shrinks outwards."""


def draw(saved: Diagnosed):
    """Medians and intervals before and after [own standard deviations] of the parameters that move most."""
    shown = saved.shifts[:AT_MOST]
    with styled():
        figure = new_figure(1.0 + 0.25 * len(shown))
        axes = figure.subplots()
        axes.axvspan(-1, 1, color="#E4E4E4", linewidth=0, label="±1 standard deviation")
        far = 3.0
        for y, shift in enumerate(shown):
            deviation = _deviation(shift, saved.level)
            far = max(far, *(abs(x) for x in _one(axes, y, shift, deviation)))
            text = signed(shift["shift_sd"])
            axes.annotate(text, (1.01, y), xycoords=("axes fraction", "data"), va="center", annotation_clip=False)
        kind = _scale(axes, far)
        axes.set_yticks(range(len(shown)), [drawable(parameter_words(saved, s["parameter"]), 44) for s in shown])
        axes.set_ylim(len(shown) - 0.4, -0.6)
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(f"shift [own standard deviations{kind}]; figures at the right: shift of the median")
        legend_below(figure, axes, columns=3)
    return figure


def _deviation(shift, level):
    """The standard deviation that the shift was counted in; from the interval where nothing moved."""
    moved, counted = shift["after"]["median"] - shift["before"]["median"], shift["shift_sd"]
    if counted and abs(counted) > 0.05 and moved:
        return abs(moved / counted)
    wide = NormalDist().inv_cdf(0.5 + level / 2)
    return max(shift["before"]["hi"] - shift["before"]["lo"], 1e-300) / (2 * wide)


def _one(axes, y, shift, scale):
    looks = (
        ("before", y - 0.17, {"color": VERMILLION, "linestyle": (0, (3, 1.5))}, "o", "white"),
        ("after", y + 0.17, {"color": BLUE, "linestyle": "-"}, "s", BLUE),
    )
    seen = []
    for key, at, look, marker, face in looks:
        away = ((shift[key][k] - shift["before"]["median"]) / scale for k in ("lo", "median", "hi"))
        lo, median, hi = (min(max(x, -FAR), FAR) for x in away)
        axes.plot([lo, hi], [at, at], linewidth=1.5, **look)
        axes.plot(median, at, marker=marker, markersize=5, markerfacecolor=face, color=look["color"], linestyle="none", label=key)
        seen += [lo, median, hi]
    return seen


def _scale(axes, far):
    """Ticks and limits; returns what the axis' name says of its scale."""
    axes.axvline(0, color="black", linewidth=0.6)
    few_ticks(axes, 10, None)
    if far > WIDE:
        axes.set_xscale("symlog", linthresh=3, linscale=1)
        steps = [3, 10, 30, 100] if far <= 150 else [10, 100, 1000]
        ticks = [t for t in (*(-s for s in reversed(steps)), 0, *steps) if abs(t) <= far]
        axes.set_xticks(ticks, [str(t).replace("-", "−") for t in ticks])
        axes.minorticks_off()
    axes.set_xlim(-1.1 * far, 1.1 * far)
    return ", logarithmic beyond ±3" if far > WIDE else ""
