"""Loops of amplitudes that were not measured: the model's prediction, corrected and widened by what is known of its error.

The logarithm of truth over prediction is a smooth Gaussian process over the logarithm of the amplitude. It is zero at the
amplitude from which is predicted, and as large as was seen wherever a smaller loop was measured too, at any rate. Its scale is
learnt from those loops and starts at 15 %; scale and length are conventions of this package, chosen on the synthetic twins.
The dissipation ratio has its error on the logit, which keeps it between 0 and 1, and S is the product of u and W_abs.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import expit, logit

SCALE, WEIGHT = 0.15, 1.0
"""Standard deviation of the log error before any loop was seen, and how many loops that knowledge counts."""
LENGTH = 0.5
"""Correlation length in the logarithm of the amplitude."""
REPEATABILITY = 0.01
"""Standard deviation by which the log errors of two rates may differ."""
KNOTS = 41
FURTHEST = 3.0
"""Log range of amplitudes below the measured one."""
MOST = 1.0
"""Largest log error that is believed."""


def error_between(name: str, found, told):
    """Error of a prediction ``told`` of an indicator against ``found``, both (draws,): log ratio, or difference of logits."""
    return _logit(found) - _logit(told) if name == "dissipation_ratio" else np.log(found / told)


def shifted(name: str, told, error):
    """A prediction with an error of :func:`error_between` put on it."""
    return expit(_logit(told) + error) if name == "dissipation_ratio" else told * np.exp(error)


def _logit(ratio):
    return logit(np.clip(ratio, 1e-9, 1 - 1e-9))


class LogError:
    """Draws of log(truth / prediction) as functions of log(amplitude / measured amplitude)."""

    def __init__(self, seen: list[tuple[float, np.ndarray]], draws: int, rng):
        """``seen`` are pairs of the log amplitude ratio (below 0) and the log error there, shape (draws,)."""
        at = np.array([0.0, *(x for x, _ in seen)])
        error = np.stack([np.zeros(draws), *(np.clip(c, -MOST, MOST) for _, c in seen)], axis=1)
        scale2 = learnt_scale(at[1:], error[:, 1:]) ** 2
        knots = np.linspace(-FURTHEST, 0.0, KNOTS)
        joint = np.concatenate([knots, at])
        prior = scale2 * (_kernel(joint, joint) + 1e-8 * np.eye(joint.size))
        path = rng.standard_normal((draws, joint.size)) @ np.linalg.cholesky(prior).T
        noise = np.r_[1e-6, np.full(at.size - 1, REPEATABILITY**2)]
        gap = error - path[:, KNOTS:] - np.sqrt(noise) * rng.standard_normal((draws, at.size))
        weight = np.linalg.solve(scale2 * _kernel(at, at) + np.diag(noise), gap.T)
        self.scale = float(np.sqrt(scale2))
        self._path = PchipInterpolator(knots, path[:, :KNOTS] + (scale2 * _kernel(knots, at) @ weight).T, axis=1)

    def at(self, log_ratio: float) -> np.ndarray:
        """Log error at a log amplitude ratio, shape (draws,)."""
        return self._path(np.clip(log_ratio, -FURTHEST, 0.0))


def learnt_scale(at, error) -> float:
    """Scale of the process from log errors (draws, loops) seen at log ratios (loops,) and from prior knowledge."""
    free = 1 - _kernel(np.zeros(1), at)[0] ** 2
    seen = np.median(error, axis=0) ** 2 / np.maximum(free, 0.1)
    return float(np.sqrt((WEIGHT * SCALE**2 + seen.sum()) / (WEIGHT + seen.size)))


def _kernel(a, b):
    return np.exp(-0.5 * ((a[:, None] - b) / LENGTH) ** 2)
