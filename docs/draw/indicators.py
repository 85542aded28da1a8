"""Drawings of the loop and of every indicator."""

from __future__ import annotations

import numpy as np
from look import COLOURS, arrow, bare, dotted, draw_loop, drawing
from reducer import clearance, elastic, first_loading, friction, loop

K = 0.35
"""Drawn far larger than the usual 0.03, so that it can be seen."""
ENDS = ((-1, "−T"), (1, "+T"))


def test_and_loop():
    """First loading, both branches and the width."""
    torque, rising, falling = loop()
    with drawing("loop", width=5.2, height=3.4) as axes:
        bare(axes, ticks=ENDS)
        axes.plot(*first_loading(), color=COLOURS["black"], linestyle=":")
        draw_loop(axes, torque, rising, falling)
        at = 0.12
        low, high = np.interp(at, torque, rising), np.interp(at, torque, falling)
        arrow(axes, (at, low), (at, high), "w(τ)", (0.24, -0.28))
        axes.text(0.42, 0.40, "θ₊(τ), rising torque", color=COLOURS["rising"], va="top")
        axes.text(-0.36, -0.40, "θ₋(τ), falling torque", color=COLOURS["falling"], va="bottom", ha="right")
        axes.text(0.24, 0.06, "first loading", fontsize=8)


def lost_motion():
    """δ between the mean branch at ±kT_r."""
    torque, rising, falling = loop()
    mean = 0.5 * (rising + falling)
    low, high = np.interp([-K, K], torque, mean)
    with drawing("lost-motion") as axes:
        bare(axes, ticks=((-K, "−kT$_r$"), (K, "+kT$_r$"), *ENDS))
        draw_loop(axes, torque, rising, falling, faint=True)
        axes.plot(torque, mean, color=COLOURS["mark"])
        axes.text(-0.98, 0.4, "mean of\nboth branches", color=COLOURS["mark"])
        dotted(axes, ((-K, -K), (0, low)), ((K, K), (0, high)), ((-K, 0.6), (low, low)), ((K, 0.6), (high, high)))
        arrow(axes, (0.6, low), (0.6, high), "δ", (0.63, low / 2))


def zero_torque_width():
    """w(0)."""
    torque, rising, falling = loop()
    low, high = np.interp(0, torque, rising), np.interp(0, torque, falling)
    with drawing("zero-torque-width") as axes:
        bare(axes, ticks=ENDS)
        draw_loop(axes, torque, rising, falling)
        arrow(axes, (0, low), (0, high), "w(0)", (0.25, -0.12), "mark")


def peak_angle():
    """Half the angle between the tips."""
    torque, rising, falling = loop()
    middle, top = 0.5 * (rising[0] + rising[-1]), rising[-1]
    with drawing("peak-angle") as axes:
        bare(axes, ticks=ENDS)
        draw_loop(axes, torque, rising, falling, faint=True)
        axes.plot([-1, 1], [rising[0], top], "o", color=COLOURS["mark"])
        dotted(axes, ((0.4, 1), (top, top)), ((0.4, 0.6), (middle, middle)))
        arrow(axes, (0.5, middle), (0.5, top), "peak angle", (0.53, 0.2), "mark")


def areas():
    """S beside W_abs, whose ratio is u."""
    torque, rising, falling = loop()
    with drawing("area-and-absorbed", 2, width=3.7) as (left, right):
        for axes in (left, right):
            bare(axes, ticks=ENDS)
        left.fill_between(torque, rising, falling, color=COLOURS["area"], alpha=0.45, linewidth=0)
        draw_loop(left, torque, rising, falling)
        left.set_title("S: dissipated in one cycle", fontsize=9)
        up, down = torque >= 0, torque <= 0
        # ∫ τ dθ is the area between a branch and the angle axis.
        right.fill_betweenx(rising[up], 0, torque[up], color=COLOURS["rising"], alpha=0.25, linewidth=0)
        right.fill_betweenx(falling[down], torque[down], 0, color=COLOURS["falling"], alpha=0.25, linewidth=0)
        draw_loop(right, torque, rising, falling)
        right.set_title("W_abs: absorbed while loading", fontsize=9)


def torque_energy():
    """w over |τ| with valley, hump and the ranges W1, W2, W3."""
    torque = np.linspace(0, 1, 600)
    width = 0.55 + 0.4 * np.exp(-(((torque - 0.3) / 0.13) ** 2)) - 0.38 * np.maximum(torque - 0.3, 0)
    top = int(np.argmax(width))
    valley, foot = width[: top + 1].min(), width[top:].min()
    one = torque[: top + 1][np.argmax(width[: top + 1] >= 0.5 * (valley + width[top]))]
    two = torque[top:][np.argmax(width[top:] <= 0.5 * (foot + width[top]))]
    with drawing("torque-energy", width=5.2) as axes:
        bare(axes, "|τ|", "w(|τ|), energy per torque", ((one, "τ₁"), (torque[top], "hump"), (two, "τ₂"), (1, "T")))
        axes.plot(torque, width, color=COLOURS["rising"])
        ranges = ((0, one, "W1", "mark"), (one, two, "W2", "area"), (two, 1.0, "W3", "other"))
        for low, high, text, colour in ranges:
            own = (torque >= low) & (torque <= high)
            axes.fill_between(torque[own], 0, width[own], color=COLOURS[colour], alpha=0.3, linewidth=0)
            axes.text(0.5 * (low + high), 0.15, text, ha="center")
        axes.set_ylim(0, 1.12)


def by_amplitude():
    """Loops of growing amplitude beside windows of the largest."""
    shades = (("mark", 0.3), ("other", 0.6), ("rising", 1.0))
    torque, rising, falling = loop()
    with drawing("by-amplitude", 2, width=3.7) as (left, right):
        for axes in (left, right):
            bare(axes, ticks=((0.6, "t"), (1, "T")))
        for colour, amplitude in reversed(shades):
            z, up, down = loop(amplitude)
            left.plot(np.r_[z, z[::-1]], np.r_[up, down[::-1]], color=COLOURS[colour])
        left.set_title("S(t), u(t): a loop of amplitude t", fontsize=9)
        draw_loop(right, torque, rising, falling, faint=True)
        inside = np.abs(torque) <= 0.6
        right.fill_between(torque[inside], rising[inside], falling[inside], color=COLOURS["area"], alpha=0.45, linewidth=0)
        right.set_title("windowed: cut out of the large loop", fontsize=9)


def back_drive():
    """θ_L and W_L of a load that arrives."""
    torque, rising, falling = loop()
    load = 0.6
    start, end = np.interp([0, load], torque, rising)
    along = (torque >= 0) & (torque <= load)
    with drawing("back-drive") as axes:
        bare(axes, ticks=((load, "τ$_L$"), (1, "+T")))
        axes.fill_betweenx(rising[along], 0, torque[along], color=COLOURS["area"], alpha=0.45, linewidth=0)
        draw_loop(axes, torque, rising, falling, faint=True)
        axes.plot(torque[along], rising[along], color=COLOURS["rising"])
        axes.text(0.06, 0.12, "W$_L$")
        dotted(axes, ((0, 0.75), (start, start)), ((load, 0.75), (end, end)), ((load, load), (0, end)))
        arrow(axes, (0.7, start), (0.7, end), "θ$_L$", (0.73, -0.1), "mark")


def modules():
    """Loops of each module alone: their areas make S."""
    parts = (("geometric: area S_g", clearance), ("elastic: no area", elastic), ("friction: area S_f", friction))
    with drawing("modules", 3, width=2.5, height=2.4) as all_axes:
        for axes, (title, part) in zip(all_axes, parts, strict=True):
            torque, rising, falling = loop(of=part)
            bare(axes, "τ", "θ", ENDS)
            axes.fill_between(torque, rising, falling, color=COLOURS["area"], alpha=0.45, linewidth=0)
            draw_loop(axes, torque, rising, falling)
            axes.set_ylim(-0.55, 0.55)
            axes.set_title(title, fontsize=9)


ALL = (
    test_and_loop, lost_motion, zero_torque_width, peak_angle, areas, torque_energy, by_amplitude, back_drive, modules,
)  # fmt: skip
