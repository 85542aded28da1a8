"""Drawings of the class's cells, of the effects and of a guarded limit."""

from __future__ import annotations

import numpy as np
from look import COLOURS, bare, dotted, draw_loop, drawing
from reducer import angle, clearance, elastic, friction, loop, path
from scipy.stats import norm


def cells():
    """The Preisach plane with the cells of each part, and the answers of three cells."""
    with drawing("cells", 2, width=3.7, height=3.2) as (plane, answers):
        plane.fill([-1, 1, -1], [-1, 1, 1], color=COLOURS["grey"], alpha=0.12, linewidth=0)
        plane.plot([-1, 1], [-1, 1], color=COLOURS["rising"], linewidth=3)
        plane.plot([-1, 0], [1, 0], color=COLOURS["falling"], linewidth=3)
        for r in (0.1, 0.25, 0.5, 0.8):
            z = np.linspace(-1 + r, 1 - r, 2)
            plane.plot(z - r, z + r, color=COLOURS["mark"], linewidth=1.2)
        plane.text(0.28, 0.1, "elastic", color=COLOURS["rising"])
        named = (("clearance", (0.05, 0.72), (-0.2, 0.2), "falling"), ("friction", (-0.97, -0.6), (-0.55, -0.05), "mark"))
        for text, at, to, colour in named:
            plane.annotate(text, to, at, color=COLOURS[colour], arrowprops={"arrowstyle": "-", "color": COLOURS[colour]})
        plane.set_xlabel("lower switching torque β")
        plane.set_ylabel("upper switching torque α")
        plane.set_xticks([-1, 0, 1])
        plane.set_yticks([-1, 0, 1])
        plane.set_aspect("equal")
        bare(answers, "z", "", ((-1, "−1"), (1, "1")))
        for crossed, width, colour in ((0.1, 0.15, "falling"), (-0.35, 0.9, "mark"), (-0.3, 0.6, "rising")):
            z, up, down = loop(of=lambda z, c=crossed, w=width: clearance(z, c, w, 1.0))
            answers.plot(np.r_[z, z[::-1]], np.r_[up, down[::-1]], color=COLOURS[colour])
        answers.set_title("answer of one cell of each part", fontsize=9)


def _along(z, name):
    """A loop as an effect would bend it, and the torque that is read; sizes are exaggerated."""
    theta, time = angle(z), np.linspace(0, 1, z.size)
    if name == "torque_offset":
        return z + 0.12, theta
    if name == "sensor_lag":
        return z, np.interp(np.arange(z.size) - 14, np.arange(z.size), theta)
    if name == "thermal_drift":
        return z, theta + 0.35 * time
    if name == "asymmetric_stiffness":
        return z, theta + 0.25 * np.abs(z)
    if name == "encoder_error":
        return z, theta + 0.05 * np.sin(2 * np.pi * theta / 0.16)
    if name == "second_backlash":
        return z, theta + clearance(z, 0.5, 0.06, 0.25)
    if name == "stick_slip":
        free = np.round(theta / 0.06) * 0.06
        return z, free
    if name == "interface_slip":
        # Slips near full load while loading, stays until it slips back.
        return z, theta + clearance(z, 0.7, 0.3, 0.3)
    if name == "rate_dependent_friction":
        return z, elastic(z) + 1.8 * friction(z / 1.8) + clearance(z)
    delayed = np.empty(z.size)
    x = 0.0
    for i, value in enumerate(z):
        x += 0.012 * (value - x)
        delayed[i] = x
    return z, theta + 0.25 * delayed


EFFECTS = (
    "interface_slip", "viscoelastic_creep", "asymmetric_stiffness", "second_backlash", "sensor_lag",
    "thermal_drift", "torque_offset", "encoder_error", "stick_slip", "rate_dependent_friction",
)  # fmt: skip


def effects():
    """One small picture an effect: clean in grey, with the effect in colour."""
    z = path(0, 1, -1, 1, -1, 1)
    settled = slice(z.size - 2 * 400 + 1, None)
    with drawing("effects", 10, height=3.6) as figure:
        for axes, name in zip(figure.subplots(2, 5).ravel(), EFFECTS, strict=True):
            bare(axes, "", "")
            draw_loop(axes, *loop(), faint=True)
            torque, theta = _along(z, name)
            shift = 0.2 if name == "thermal_drift" else 0.0
            axes.plot(torque[settled], theta[settled] - shift, color=COLOURS["rising"], linewidth=1.0)
            axes.set_title(name.replace("_", " "), fontsize=8)
            axes.set_xlim(-1.15, 1.2)


def acceptance():
    """A posterior, an upper limit, the guard band, and the two risks."""
    x = np.linspace(-4, 4.5, 400)
    with drawing("acceptance", width=5.2, height=2.6) as axes:
        bare(axes, "indicator", "", ((0, "median"), (1.645, "limit")))
        axes.spines["left"].set_visible(False)
        axes.plot(x, norm.pdf(x), color=COLOURS["rising"])
        out = x >= 1.645
        axes.fill_between(x[out], 0, norm.pdf(x[out]), color=COLOURS["falling"], alpha=0.5, linewidth=0)
        axes.fill_between(x[~out], 0, norm.pdf(x[~out]), color=COLOURS["mark"], alpha=0.2, linewidth=0)
        dotted(axes, ((1.645, 1.645), (0, 0.42)), ((0, 0), (0, 0.42)))
        axes.annotate("", (1.645, 0.41), (0, 0.41), arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0})
        axes.text(0.82, 0.42, "guard band", ha="center", va="bottom")
        axes.text(2.1, 0.12, "consumer's risk\nif accepted", color=COLOURS["falling"])
        axes.text(-0.3, 0.1, "conformance\nprobability", color=COLOURS["mark"], ha="center")
        axes.set_ylim(0, 0.47)


ALL = (cells, effects, acceptance)
