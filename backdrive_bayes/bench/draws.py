"""Random draws that every bench needs."""

from __future__ import annotations

import numpy as np


def log_uniform(rng, low: float, high: float) -> float:
    """A number between ``low`` and ``high``, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def sign(rng) -> float:
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))
