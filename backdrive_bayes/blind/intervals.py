"""Shares with their counts and intervals, means with their standard errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import betaincinv

LEVEL = 0.95


def clopper_pearson(count: float, of: float, level: float = LEVEL) -> tuple[float, float]:
    """Exact binomial interval of a share (Clopper & Pearson 1934, doi:10.1093/biomet/26.4.404); (0, 1) for none of none."""
    tail = 0.5 * (1.0 - level)
    low = betaincinv(count, of - count + 1.0, tail) if count > 0 else 0.0
    high = betaincinv(count + 1.0, of - count, 1.0 - tail) if count < of else 1.0
    return float(low), float(high)


def share(hits: Iterable[bool]) -> dict:
    """Share of true values, with ``count`` and ``of`` and its binomial interval; the share is None where there are none."""
    hits = [bool(hit) for hit in hits]
    low, high = clopper_pearson(sum(hits), len(hits))
    return {"share": sum(hits) / len(hits) if hits else None, "count": sum(hits), "of": len(hits), "lo": low, "hi": high}


def macro_share(groups: Sequence[Sequence[bool]]) -> dict:
    """Mean of the groups' shares, each group weighing the same, whatever its size.

    The interval is the binomial one at the number of units, ``effective``, that would leave the mean as uncertain:
    K² / Σ 1/n over K groups of n.
    """
    groups = [group for group in groups if len(group)]
    if not groups:
        return {"share": None, "groups": 0, "of": 0, "effective": 0.0, "lo": 0.0, "hi": 1.0}
    mean = float(np.mean([np.mean(group) for group in groups]))
    effective = len(groups) ** 2 / sum(1.0 / len(group) for group in groups)
    low, high = clopper_pearson(mean * effective, effective)
    return {"share": mean, "groups": len(groups), "of": sum(map(len, groups)), "effective": effective, "lo": low, "hi": high}


def mean_of(values: Iterable[float]) -> dict:
    """Mean and median with the mean's standard error and the count."""
    values = np.array(list(values), float)
    if not values.size:
        return {"mean": None, "median": None, "standard_error": None, "of": 0}
    error = float(values.std(ddof=1) / np.sqrt(values.size)) if values.size > 1 else None
    return {"mean": float(values.mean()), "median": float(np.median(values)), "standard_error": error, "of": values.size}
