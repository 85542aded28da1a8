"""The functions a claim may call: plain functions of arrays whose last axis is the series (rate, amplitude or torque)."""

from __future__ import annotations

import numpy as np


def spread(x, along=None):
    """(largest − smallest) / mean of a series."""
    return (x.max(axis=-1) - x.min(axis=-1)) / np.abs(x.mean(axis=-1))


def ratio_of_extremes(x, along=None):
    """Largest over smallest of a series."""
    return x.max(axis=-1) / x.min(axis=-1)


def mean(x, along=None):
    """Mean of a series."""
    return x.mean(axis=-1)


def largest(x, along=None):
    """Largest of a series."""
    return x.max(axis=-1)


def smallest(x, along=None):
    """Smallest of a series."""
    return x.min(axis=-1)


def rises(x, along=None):
    """Whether every value is above the one before."""
    return (np.diff(x, axis=-1) > 0).all(axis=-1)


def falls(x, along=None):
    """Whether every value is below the one before."""
    return (np.diff(x, axis=-1) < 0).all(axis=-1)


def one_valley(x, along=None):
    """Whether the series falls to one interior minimum and rises from there."""
    sign = np.diff(x, axis=-1) > 0
    return (np.diff(sign.astype(int), axis=-1) >= 0).all(axis=-1) & ~sign[..., 0] & sign[..., -1]


def at_lowest(x, along):
    """Where the series is lowest."""
    return along[np.argmin(x, axis=-1)]


def at_highest(x, along):
    """Where the series is highest."""
    return along[np.argmax(x, axis=-1)]


def linearity(x, along):
    """R² of a straight line through the series."""
    t = along - along.mean()
    slope = (x * t).sum(axis=-1) / (t @ t)
    centred = x - x.mean(axis=-1, keepdims=True)
    return 1 - ((centred - slope[..., None] * t) ** 2).sum(axis=-1) / (centred**2).sum(axis=-1)


def log_slope(x, along):
    """Slope of the logarithm over the logarithm of a positive series."""
    t = np.log(along) - np.log(along).mean()
    return (np.log(x) * t).sum(axis=-1) / (t @ t)


def double_humped(x, along):
    """Whether on both sides of zero torque the curve rises above its value at zero torque."""
    centre = x[..., np.argmin(np.abs(along))]
    return (x[..., along > 0].max(axis=-1) > centre) & (x[..., along < 0].max(axis=-1) > centre)


FUNCTIONS = {
    f.__name__: f
    for f in (
        spread, ratio_of_extremes, mean, largest, smallest, rises, falls, one_valley, at_lowest, at_highest, linearity,
        log_slope, double_humped,
    )
}  # fmt: skip
"""Name in a claim → function of (series, coordinate)."""
