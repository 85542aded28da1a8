"""White noise of a channel, told from its samples alone."""

import numpy as np

ENOUGH = 20_000
"""Samples that tell the median to a percent."""
ON_A_LINE = 1e-4
"""Distance from a line, in the step from sample to sample, below which a sample is on it."""


def white_noise(values: np.ndarray, time_s: np.ndarray | None = None) -> float:
    """Robust standard deviation of the noise of a sample of ``values`` (samples,), in their unit.

    Samples without ``time_s`` [s] are taken to be evenly apart.
    """
    if len(values) < 3:
        return 0.0
    # What a sample is beside the line through its neighbours: ramps drop out.
    at = np.arange(0, len(values) - 2, max(1, len(values) // ENOUGH))
    share = np.full(at.size, 0.5)
    if time_s is not None:
        span = time_s[at + 2] - time_s[at]
        share = np.where(span > 0, (time_s[at + 1] - time_s[at]) / np.where(span > 0, span, 1.0), 0.5)
    beside = values[at + 1] - (1.0 - share) * values[at] - share * values[at + 2]
    beside = np.abs(beside) / np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    median = float(1.4826 * np.median(beside))
    # Most samples of a channel that is rounded coarsely are on a line with their neighbours, but for the rounding of their times.
    step = float(np.sqrt(np.mean(np.diff(values) ** 2)))
    return median if median > ON_A_LINE * step else float(np.sqrt(np.mean(beside**2)))
