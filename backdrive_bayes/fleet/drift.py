"""Drift of an indicator along a fleet: the largest difference between the units before and from a point on, wherever it lies.

Where nothing drifts every order of the units is as probable as any other, so that the largest difference over shuffled orders is
what chance gives, for any distribution of the values (a permutation test of a change at an unknown point; Pettitt, Applied
Statistics 28 (1979) 126, here with normal scores).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm, rankdata

FALSE_ALARM = 0.01
"""Probability that a fleet without drift is given any alarm: one report in a hundred."""
SHUFFLES = 4999
"""Orders tried; with one more their number divides by the false-alarm rates in use."""
FEWEST = 10
"""Units below which no order tells anything at so low a rate."""
_TAILS = 0.05
"""Share of the values at each end that say no more than their neighbours about where the drift begins."""
_AT_ONCE = 2_000_000
"""Numbers held at a time."""


@dataclass(frozen=True, eq=False)
class Drift:
    """The differences ``path`` (units,) in standard deviations of their own, their ``limit`` to both sides, and what follows.

    ``path[i]`` compares the units from number i on with those before; that of the first unit is 0. ``first`` is the number of
    the unit from which on the values differ most, None where all differences are within the limit. ``probability`` is that of as
    large a difference by chance, ``false_alarm`` the share of fleets without drift that get an alarm, at most.
    """

    path: np.ndarray
    limit: float
    probability: float
    false_alarm: float
    first: int | None


def find_drift(values, false_alarm: float, seed: int = 0) -> Drift | None:
    """Drift of ``values`` (units,) in their order; None for fewer than ``FEWEST`` of them.

    Values enter by the normal scores of their ranks, so that an outlier is one unit and no drift.
    """
    values = np.asarray(values, float)
    if values.size < FEWEST:
        return None
    scores = _standard(norm.ppf((rankdata(values) - 0.5) / values.size))
    path = differences(scores)
    largest = _shuffled(scores, np.random.default_rng(seed))
    allowed = max(1, int(np.floor(false_alarm * (SHUFFLES + 1) + 1e-9)))
    limit = float(np.sort(largest)[-allowed])
    found = float(np.abs(path).max())
    probability = (1 + int((largest >= found - 1e-9).sum())) / (SHUFFLES + 1)
    return Drift(path, limit, probability, false_alarm, _first(values) if found > limit + 1e-9 else None)


def differences(scores) -> np.ndarray:
    """Mean of the scores from each place on less that of those before, in its standard deviation over all orders; (…, units).

    Scores have mean 0 and standard deviation 1.
    """
    n = scores.shape[-1]
    before = np.arange(1, n)
    path = np.zeros(scores.shape)
    path[..., 1:] = -np.cumsum(scores, axis=-1)[..., :-1] / np.sqrt(before * (n - before) / (n - 1))
    return path


def _first(values) -> int:
    """Where the values themselves change most; ranks tell a large change from none, but not well where it begins."""
    clipped = np.clip(values, *np.quantile(values, [_TAILS, 1 - _TAILS]))
    return int(np.abs(differences(_standard(clipped))).argmax())


def _standard(values) -> np.ndarray:
    return (values - values.mean()) / max(values.std(), 1e-300)


def _shuffled(scores, rng) -> np.ndarray:
    """Largest differences over shuffled orders, (SHUFFLES,)."""
    found, left = [], SHUFFLES
    while left:
        rows = min(left, max(1, _AT_ONCE // scores.size))
        orders = rng.permuted(np.broadcast_to(scores, (rows, scores.size)), axis=-1)
        found.append(np.abs(differences(orders)).max(axis=-1))
        left -= rows
    return np.concatenate(found)
