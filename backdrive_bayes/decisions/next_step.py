"""What to measure next: how many repeats would settle a verdict, and what to do where repeats cannot."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.decisions.conformance import normal_conformance
from backdrive_bayes.number_text import plain

MOST = 100
"""Repeats beyond which measuring again is no advice."""


def repeats_to_settle(rows, consumer: float, producer: float) -> int | None:
    """Measurements in all, the present one included, after which one risk would be at most the agreed one.

    Supposes that every row's median stays, that limits are kept or broken independently, and that repeats shrink the variance as
    1/n. None where no number up to ``MOST`` would do.
    """
    n = np.arange(2, MOST + 1)
    within = np.ones(n.size)
    for row in rows:
        spread = max(row["sd"], 1e-300) / np.sqrt(n)
        within = within * normal_conformance(row["median"], spread, row["min"], row["max"])
    settled = (1 - within <= consumer) | (within <= producer)
    return int(n[np.argmax(settled)]) if settled.any() else None


def advice(row: dict, repeats: int | None) -> str:
    """One sentence for an inconclusive verdict and its limiting row."""
    where = f"{plain(row['loading_rate_Nm_per_s'])} N·m/s and ±{plain(row['amplitude_Nm'])} N·m"
    if row["predicted"]:
        return f"Measure a loop at {where} itself: the verdict on {row['indicator']} rests on a prediction from a larger loop."
    if repeats is not None:
        extra = repeats - 1
        text = f"Repeat the records {extra} time{'s'[: extra != 1]} more, first the loop at {where}, mounting the unit anew: "
        return text + f"{repeats} of each in all would settle the verdict if the medians stay."
    return (
        f"{row['indicator']} at {where} lies so near to its limit that {MOST} repeats would not settle it: the unit is on the "
        "limit; agree on other risks or judge it as it is."
    )
