"""One look for all drawings: bare axes through zero, words at what they mean."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

from backdrive_bayes.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    Figure,
    FigureCanvasAgg,
    matplotlib,
)

OUT = Path(__file__).resolve().parents[1] / "drawings"
COLOURS = {
    "black": BLACK, "rising": BLUE, "falling": VERMILLION, "area": ORANGE, "mark": GREEN, "other": PURPLE, "grey": GREY,
}  # fmt: skip


@contextmanager
def drawing(name, columns=1, width=4.2, height=3.0):
    """Axes of a new drawing, saved as ``name``.svg with shapes for letters, so that it looks alike everywhere."""
    style = {"font.size": 9, "svg.fonttype": "path", "svg.hashsalt": "backdrive_bayes", "lines.linewidth": 1.4}
    with matplotlib.rc_context(style):
        figure = Figure(figsize=(width * columns if columns < 4 else 7.6, height), layout="constrained", facecolor="white")
        FigureCanvasAgg(figure)
        yield figure.subplots(1, columns) if columns < 4 else figure
        figure.savefig(OUT / f"{name}.svg", metadata={"Date": None})


def bare(axes, x="torque τ", y="angle θ", ticks=()):
    """Axes that cross at zero, named at their ends, with ticks (value, text) on the torque axis."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_position("zero")
        axes.spines[side].set_color(COLOURS["grey"])
        axes.spines[side].set_linewidth(0.7)
        axes.spines[side].set_zorder(0.5)
    axes.set_xticks([v for v, _ in ticks], [t for _, t in ticks])
    axes.set_yticks([])
    axes.tick_params(length=3, color=COLOURS["grey"])
    axes.annotate(x, (1.0, 0.0), xycoords=("axes fraction", "data"), xytext=(0, 4), textcoords="offset points", ha="right")
    axes.annotate(y, (0.0, 1.0), xycoords=("data", "axes fraction"), xytext=(4, 0), textcoords="offset points", va="top")


def draw_loop(axes, torque, rising, falling, faint=False):
    """Both branches, thin and grey where they are the background."""
    look = {"color": COLOURS["grey"], "linewidth": 0.9} if faint else {}
    axes.plot(torque, rising, **({"color": COLOURS["rising"]} | look))
    axes.plot(torque, falling, **({"color": COLOURS["falling"], "linestyle": "-" if faint else (0, (5, 2))} | look))


def arrow(axes, start, end, text="", at=None, colour="black", ha="left", va="center"):
    """A double arrow between two points, with a word beside it."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "color": COLOURS[colour], "shrinkA": 0, "shrinkB": 0})
    if text:
        axes.text(*(at or end), text, ha=ha, va=va, color=COLOURS[colour])


def dotted(axes, *lines):
    """Thin dotted lines ((x, x), (y, y))."""
    for x, y in lines:
        axes.plot(x, y, color=COLOURS["grey"], linestyle=":", linewidth=1.0)
