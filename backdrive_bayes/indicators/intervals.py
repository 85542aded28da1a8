"""Intervals of draws, as every result file writes them."""

from __future__ import annotations

import numpy as np

LEVEL = 0.9


def ends(level: float) -> list[float]:
    """Shares of the lower end, the median and the upper end of the central interval at a level."""
    return [0.5 - level / 2, 0.5, 0.5 + level / 2]


def named(lo: float, median: float, hi: float) -> dict[str, float]:
    """An interval as result files write it."""
    return {"median": float(median), "lo": float(lo), "hi": float(hi)}


def bands(values, level: float = LEVEL) -> dict[str, list[float]]:
    """Median and central interval at every point of curves (draws, points)."""
    lo, median, hi = np.quantile(values, ends(level), axis=0)
    return {"median": median.tolist(), "lo": lo.tolist(), "hi": hi.tolist()}


def central(values, level: float = LEVEL) -> dict[str, float]:
    """Median and central interval of ``values`` (draws,)."""
    return named(*np.quantile(values, ends(level)))


def interval(values, level: float = LEVEL) -> dict | None:
    """The same; None where the quantity is not defined."""
    return None if np.isnan(values).all() else central(values, level)


def over_positions(area, ratio, level: float = LEVEL) -> dict:
    """Intervals of S and u, arrays (positions, draws), at every torque position, and of their extremes and means over them."""
    return {
        "loop_area_J": [interval(v, level) for v in area],
        "dissipation_ratio": [interval(v, level) for v in ratio],
        **{
            f"{name}_{key}": interval(f(v, axis=0), level)
            for key, v in (("S_J", area), ("u", ratio))
            for name, f in (("max", np.max), ("min", np.min), ("mean", np.mean))
        },
    }
