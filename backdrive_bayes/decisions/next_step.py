"""What to measure next: how many repeats would settle a limit, and what to do where repeats cannot."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.decisions.conformance import normal_conformance

MOST = 100
"""Repeats beyond which measuring again is no advice."""


def repeats_to_settle(median, sd, model_error_share, lo, hi, consumer: float, producer: float) -> int | None:
    """Measurements in all, the present one included, after which one risk would be at most the agreed one.

    Supposes that the median stays and that repeats shrink the variance as 1/n, but for the ``model_error_share`` of it, which
    is the same in every repeat. None where more than ``MOST`` or no number would do.
    """
    n = np.arange(1, MOST + 1)
    spread = sd * np.sqrt(model_error_share + (1 - model_error_share) / n)
    within = normal_conformance(median, spread, lo, hi)
    settled = (1 - within <= consumer) | (within <= producer)
    return int(n[np.argmax(settled)]) if settled.any() else None


def advice(row: dict, repeats: int | None) -> str:
    """One sentence for the limiting indicator of an inconclusive verdict."""
    where = f"{row['loading_rate_Nm_per_s']:.3g} N·m/s and ±{row['amplitude_Nm']:.3g} N·m"
    if row["predicted"]:
        return f"Measure a loop at {where} itself: the verdict on {row['indicator']} rests on a prediction from a larger loop."
    share = row["model_error_share"]
    if repeats is not None and repeats > 1:
        extra = repeats - 1
        text = f"Repeat the loop at {where} {extra} time{'s'[: extra != 1]} more, mounting the unit anew: "
        return text + f"{repeats} records in all would settle {row['indicator']} if its median stays."
    if repeats == 1:
        return f"No single limit is in doubt but all together are; repeat the loop at {where}, the nearest to its limit."
    if share and share > 0.5:
        return (
            f"Repeats will not settle {row['indicator']} at {where}: {share:.0%} of its variance is model error, which is the "
            "same in every repeat. Diagnose the gap and fit with the effect that it names, or measure at further amplitudes."
        )
    return (
        f"{row['indicator']} at {where} lies so near to its limit that {MOST} repeats would not settle it: the unit is on the "
        "limit; agree on other risks or judge it as it is."
    )
