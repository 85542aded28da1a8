"""The page reports/batch-pooling/README.md from coverage.json and fits.json beside it.

    python studies/batch_pooling_page.py
"""

from __future__ import annotations

import json
from pathlib import Path

HOME = Path(__file__).parents[1] / "reports" / "batch-pooling"
WORDS = {
    "lost_motion_rad": "lost motion [mrad]",
    "zero_torque_width_rad": "width at zero torque [mrad]",
    "peak_angle_rad": "peak angle [mrad]",
    "loop_area_J": "dissipated energy [mJ]",
    "absorbed_J": "absorbed energy [mJ]",
    "dissipation_ratio": "dissipation ratio",
}
SIMULATED = """## Simulated batches

`python studies/batch_pooling.py --batches {batches}`: {batches} batches a line, 1600 posterior draws a unit. Every other
likelihood is skewed, units differ in precision by a factor of four, and priors are displaced by their own width. The spread is
given in a unit's usual standard deviation. Numbers are shares of 90 % intervals that hold the truth; 99 % binomial bounds, of
as many batches as were not refused, are {low:.3f} – {high:.3f} at the widest.

Mean and spread keep to the lower bound in {held} of {lines} lines. Above the upper bound are batches of five units, and spreads
that cannot be told from none: intervals are too wide there, not too narrow.
"""
REAL = """## A batch of real fits

`python studies/batch_pooling_fits.py --keep FOLDER`: {units} virtual reducers measured once, every third on a bench with much
slow noise, fitted, kept and pooled. True numbers are of 400 reducers of the batch without noise. Spreads are in per cent of the
mean.
"""
SIMULATED_COLUMNS = (
    *("units", "true spread", "mean", "spread", "next unit", "pooled units"),
    *("pooled width / own", "refused", "loss [bit]"),
)
REAL_COLUMNS = (
    *("indicator", "true mean", "mean", "true spread", "spread"),
    *("held, own", "held, pooled", "narrowest", "loss [bit]"),
)


def table(columns, rows) -> list[str]:
    """Lines of a table."""
    return [f"| {' | '.join(cells)} |" for cells in (columns, ["---"] * len(columns), *rows)]


def coverage_lines(cells: list[dict]) -> list[str]:
    """Simulated batches, sound and with planted faults."""
    sound, faulty = ([c for c in cells if (c["fault"] == "none") == kind] for kind in (True, False))
    low, high = min(c["bounds"][0] for c in sound), max(c["bounds"][1] for c in sound)
    held = sum(c["holds"] for c in sound)
    text = SIMULATED.format(batches=sound[0]["batches"], low=low, high=high, held=held, lines=len(sound))
    found = [f"{c['fault']}, {c['units']} units, spread {c['ratio']:g}: {_shares(c)}" for c in faulty]
    return [
        *text.splitlines(), "", *table(SIMULATED_COLUMNS, map(_cell, sound)), "",
        "Refused: batches / units in all.", "",
        "Planted faults, with the coverage of mean and spread and whether it falls below the bound:", "",
        *(f"- {line}" for line in found), "",
    ]  # fmt: skip


def _shares(c) -> str:
    return f"{c['mean']:.3f} and {c['spread']:.3f}, {'not found out' if c['holds'] else 'found out'}"


def _cell(c) -> list[str]:
    shares = [f"{c[key]:.3f}" for key in ("mean", "spread", "next", "of_units")]
    refused = f"{c['refused']} / {c['units_refused']}"
    return [str(c["units"]), f"{c['ratio']:g}", *shares, f"{c['narrower']:.2f}", refused, f"{c['loss_bits']:.4f}"]


def fits_lines(found: dict) -> list[str]:
    """The batch of real fits."""
    reading, pooling = found["reading_s_a_unit"], found["pooling_s"]
    cost = f"{reading:.1f} s a unit for draws of its posterior and prior, {pooling:.0f} s for all quantities"
    return [
        *REAL.format(units=found["units"]).splitlines(), "",
        *table(REAL_COLUMNS, [_fit(name, row) for name, row in found["indicators"].items()]), "",
        f"Narrowest: width of a pooled interval in that of the unit alone. Cost beside the fits: {cost}.",
    ]  # fmt: skip


def _fit(name, row) -> list[str]:
    factor = 1e3 if name.endswith(("_rad", "_J")) else 1.0
    true = f"{factor * row['true_mean']:.4g}"
    if row["refused"]:
        return [WORDS[name], true, f"refused: {row['refused']}", *[""] * 6]
    size = 100.0 if row["scale"] == "log" else 100.0 / row["true_mean"]
    held = [f"{row[key]} of {row['pooled']}" for key in ("own_held", "pooled_held")]
    mean, spread = (_interval(row[key], scale) for key, scale in (("mean", factor), ("spread", size)))
    true_spread, loss = f"{size * row['true_spread']:.2g}", f"{row['loss_bits']:.4f}"
    return [WORDS[name], true, mean, true_spread, spread, *held, f"{row['narrowest']:.2f}", loss]


def _interval(found, factor) -> str:
    median, lo, hi = (factor * found[key] for key in ("median", "lo", "hi"))
    return f"{median:.3g} [{lo:.3g}, {hi:.3g}]"


def main():
    """Write the page."""
    cells, fits = (json.loads((HOME / name).read_text(encoding="utf-8")) for name in ("coverage.json", "fits.json"))
    lines = ["# Is partial pooling calibrated?", "", *coverage_lines(cells), *fits_lines(fits)]
    (HOME / "README.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
