"""What the measured cycloidal units show without any model, and the page and figure of studies/real_loops.py."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from backdrive_bayes.records.branches import find_segments

CREDIT = "github.com/JelmerV/Anti-Backlash-Cycloidal-Actuator, Code/test_data, CC BY-SA 4.0"
LEVELS = np.linspace(0.1, 0.85, 31)
"""Shares of a loop's amplitude at which branches are compared."""
COVERED = 0.85


def broken_assumptions(unit) -> dict:
    """Rms departures of the small loops from what every reducer of the class does, in shares of their half range.

    ``repeat``: five loops from their mean, offsets taken out. ``symmetry``: loading and unloading from their mirror images.
    ``drift``: largest step of the offset from one loop to the next.
    """
    records = [r for r in unit.records if r.name.startswith("small")]
    branches = np.array([_branches(r) for r in records])
    half = 0.5 * np.mean([np.ptp(r.angle_rad) for r in records])
    offset = branches.mean(axis=(1, 2))
    loops = branches - offset[:, None, None]
    repeat = np.sqrt(np.mean((loops - loops.mean(axis=0)) ** 2))
    even = 0.5 * (loops[:, :2] + loops[:, 2:])
    symmetry = np.sqrt(np.mean((even - even.mean(axis=(1, 2), keepdims=True)).mean(axis=0) ** 2))
    drift = np.abs(np.diff(offset)).max()
    return {name: float(v / half) for name, v in (("repeat", repeat), ("symmetry", symmetry), ("drift", drift))} | {
        "half_range_rad": float(half)
    }


def _branches(record):
    """Angles [rad] at LEVELS of load+, unload+ and then of their mirrors load-, unload-, (4, levels)."""
    legs = find_segments(record.time_s, record.torque_nm)[:3]
    top = np.abs(record.torque_nm).max() * LEVELS
    found = []
    for leg, sign in ((0, 1), (1, 1), (1, -1), (2, -1)):
        own = slice(legs[leg].start, legs[leg].stop)
        torque = sign * record.torque_nm[own]
        width = 0.5 * (top[1] - top[0])
        near = np.abs(torque[:, None] - top) <= 2 * width
        angle = (record.angle_rad[own][:, None] * near).sum(axis=0) / np.maximum(near.sum(axis=0), 1)
        found.append(np.where(near.any(axis=0), angle, np.nan))
    filled = [np.interp(LEVELS, LEVELS[np.isfinite(f)], f[np.isfinite(f)]) for f in found]
    return np.array(filled)


def write_page(out: Path, fits: list[dict], named: list[dict], trends: list[dict], units: int) -> None:
    """README.md, real_loops.json without draws, and refused.png of what there is so far."""
    kept = [{k: v for k, v in r.items() if k not in ("draws", "curves")} for r in fits]
    found = {"credit": CREDIT, "units": kept, "trends": trends, "withheld": named}
    (out / "real_loops.json").write_text(json.dumps(found, indent=1))
    lines = [
        "# Measured cycloidal units", "",
        "Made by `python studies/real_loops.py`. Data: " + CREDIT + "; read from where they are, not copied.", "",
        f"{len(fits)} of {units} units reached, {sum(r['all']['converged'] for r in fits)} converged; "
        f"median {np.median([r['seconds'] for r in fits]):.0f} s of wall time a fit of eight loops (machine shared with others). "
        f"Small loops predicted from the large ones alone: coverage of 90 % bands at least {COVERED} on "
        f"{sum(r['small_predicted']['coverage_of_90'] >= COVERED for r in fits)} units.", "",
        "| unit | converged | s | coverage | missed by | band | fit of all leaves | loops differ by | uneven by | offset steps |",
        "|" + "---|" * 10, *(_row(r) for r in fits), "",
        "Shares of the small loops' half range, in per cent: rms by which the median prediction misses, mean half width of the",
        "band, rms that a fit of all eight loops leaves, rms of the five loops about their mean, of loading and unloading about",
        "their mirror images, largest step of the offset between loops.", "", *_reading(fits), "",
        "## Along the preload", "",
        "| from | to | clearance falls | friction torque rises | loops: w(0) falls | loops: S rises |",
        "|" + "---|" * 6, *(_trend(row) for row in trends), "",
        "Probabilities from independent posteriors; the last two columns are shares of pairs of large loops that order so.", "",
    ]  # fmt: skip
    if named:
        lines += ["## With a module withheld", ""]
        for module in ("geometric", "friction"):
            own = [r for r in named if r["module"] == module]
            hits = [r for r in own if module in r["effects"]]
            others = "; ".join(f"{r['unit']}: {' + '.join(r['effects']) or 'none'}" for r in own if r not in hits)
            rest = f" (otherwise {others})" if others else ""
            lines += [f"{module}: named in {len(hits)} of {len(own)} units{rest}.", ""]
    (out / "README.md").write_text("\n".join([*lines, "![Best, middle and worst prediction](refused.png)", ""]), encoding="utf-8")
    if fits:
        draw(fits, out / "refused.png")


def _row(r) -> str:
    half, p, b = r["broken"]["half_range_rad"], r["small_predicted"], r["broken"]
    share = (p["rms_rad"] / half, 0.5 * p["mean_width_rad"] / half, r["left_rad"] / half, b["repeat"], b["symmetry"], b["drift"])
    word = "yes" if r["all"]["converged"] else "no"
    cells = " | ".join(f"{100 * v:.1f}" for v in share)
    return f"| {r['unit']} | {word} | {r['seconds']:.0f} | {p['coverage_of_90']:.2f} | {cells} |"


def _reading(fits) -> list[str]:
    """Which assumption breaks where the prediction misses: what exceeds half of the miss, else the step in amplitude itself."""
    words = {"repeat": "loops do not repeat", "symmetry": "the two directions differ"}
    lines = []
    for r in (r for r in fits if r["small_predicted"]["coverage_of_90"] < COVERED):
        half, broken = r["broken"]["half_range_rad"], r["broken"]
        miss = r["small_predicted"]["rms_rad"] / half
        reasons = [text for name, text in words.items() if broken[name] > 0.5 * miss]
        if r["left_rad"] / half > 0.5 * miss:
            reasons.append("one operator does not hold both amplitudes (congruency)")
        if not reasons:
            reasons = ["nothing that the class assumes: a fit of all loops holds them, the step from large to small is missed"]
        lines.append(f"- {r['unit']}: missed by {100 * miss:.0f} %; " + "; ".join(reasons) + ".")
    return lines


def _trend(row) -> str:
    if "inconclusive" in row:
        return f"| {row['from']} | {row['to']} | {row['inconclusive']} | | | |"
    keys = ["P(clearance_rad falls)", "P(friction_torque_Nm rises)"]
    keys += ["P(zero_torque_width_rad falls), loops", "P(loop_area_J rises), loops"]
    return f"| {row['from']} | {row['to']} | " + " | ".join(f"{row[k]:.2f}" for k in keys) + " |"


def draw(fits, path: Path) -> None:
    """A small loop with its prediction from the large ones: best, middle and worst unit."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    order = sorted(fits, key=lambda r: r["small_predicted"]["rms_rad"] / r["broken"]["half_range_rad"])
    chosen = [order[0], order[len(order) // 2], order[-1]]
    figure, axes = plt.subplots(1, 3, figsize=(11, 4.2))
    for axis, r in zip(axes, chosen, strict=True):
        c, half = {k: np.array(v) for k, v in r["curves"].items()}, r["broken"]["half_range_rad"]
        middle = np.mean(c["measured"])
        for edge, name in ((c["lo"], "90 % band from the large loops"), (c["hi"], None)):
            axis.plot(c["torque_nm"], 100 * (edge - middle) / half, color="#0072B2", lw=0.6, alpha=0.7, label=name)
        axis.plot(c["torque_nm"], 100 * (c["middle"] - middle) / half, color="#0072B2", lw=1.4, label="its median")
        axis.plot(c["torque_nm"], 100 * (c["measured"] - middle) / half, "k.", ms=2, label="measured")
        miss = 100 * r["small_predicted"]["rms_rad"] / half
        axis.set(title=f"{r['unit']}: missed by {miss:.0f} %", xlabel="torque, N·m", ylabel="angle, % of half range")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="lower right", ncols=3, frameon=False, fontsize=8)
    figure.text(0.01, 0.02, "Data: " + CREDIT, fontsize=6)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    figure.savefig(path, dpi=110)
    plt.close(figure)
