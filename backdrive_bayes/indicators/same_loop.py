"""When two loading rates, or two amplitudes, count as the same: one answer for indicators, decisions and claims."""

from __future__ import annotations

import numpy as np

SAME_RATE = 0.1
"""Relative difference up to which two loading rates are the same: drives hold a ramp to a few per cent."""
SAME_AMPLITUDE = 0.02
"""Relative difference up to which two amplitudes are the same: turning points scatter by about one per cent."""


def same_rate(a: float, b: float) -> bool:
    """Whether two loading rates are the same."""
    return abs(a / b - 1) <= SAME_RATE


def same_amplitude(a: float, b: float) -> bool:
    """Whether two amplitudes are the same."""
    return abs(a / b - 1) <= SAME_AMPLITUDE


def most_alike(torques) -> float:
    """The one of several torques that most others are the same as; of several such the first."""
    values = np.asarray(torques, float)
    rising = np.sort(values)
    first = np.searchsorted(rising, values * (1 - SAME_AMPLITUDE), "left")
    last = np.searchsorted(rising, values * (1 + SAME_AMPLITUDE), "right")
    return float(values[np.argmax(last - first)])
