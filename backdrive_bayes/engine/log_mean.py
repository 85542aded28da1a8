"""Averages of probabilities whose logarithms are known."""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp


def log_mean(logs, axis: int | None = None):
    """Logarithm of the mean of exp(``logs``) along an axis, or of all, each as likely."""
    logs = np.asarray(logs)
    return logsumexp(logs, axis=axis) - np.log(logs.size if axis is None else logs.shape[axis])
