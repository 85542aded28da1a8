"""Random draws that every bench needs."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_banded


def log_uniform(rng, low: float, high: float) -> float:
    """A number between ``low`` and ``high``, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def sign(rng) -> float:
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def scattered(k):
    """Numbers between 0 and 1 for integers ``k``, spread by the golden ratio: even as a whole, unlike from one to the next."""
    return (0.5 + 0.5 * (np.sqrt(5.0) - 1.0) * k) % 1.0


def ornstein_uhlenbeck(rng, samples: int, keep: float):
    """A stationary first-order process of unit variance, shape (samples,), of which a step keeps the share ``keep``."""
    push = rng.standard_normal(samples)
    push[1:] *= np.sqrt(1.0 - keep**2)
    return first_order(push, keep)


def first_order(push, keep: float):
    """Values (samples,) of which a step keeps the share ``keep`` and adds ``push`` (samples,)."""
    return solve_banded((1, 0), np.array([np.ones(len(push)), np.full(len(push), -keep)]), push)
