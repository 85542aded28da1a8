"""Intervals of draws, as every result file writes them."""

from __future__ import annotations

import numpy as np

LEVEL = 0.9


def interval(values, level: float = LEVEL) -> dict | None:
    """Median and central interval of ``values`` (draws,); None where the quantity is not defined."""
    if np.isnan(values).all():
        return None
    lo, median, hi = np.quantile(values, [0.5 - level / 2, 0.5, 0.5 + level / 2])
    return {"median": float(median), "lo": float(lo), "hi": float(hi)}


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
