"""Mixtures of normals on the line: fitted to weighted draws, and what is asked of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

MOST = 3
"""Components: two can be skewed or heavy-tailed, a third serves what is both."""
STEPS = 100
GAIN = 1e-5
"""Gain of the mean log density below which a fit is at its end; over a thousand draws far less than decides between fits."""
NARROWEST = 0.02
"""Least standard deviation of a component in that of the draws, so that none collapses onto a draw."""
LOG_ROOT = 0.5 * np.log(2 * np.pi)
"""What a normal density has in its logarithm besides its standard deviation."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """Shares ``weight``, ``mean`` and ``sd`` of normal components, (components,) each."""

    weight: np.ndarray
    mean: np.ndarray
    sd: np.ndarray

    def log_density(self, x) -> np.ndarray:
        """Log density at ``x`` (points,)."""
        return log_sum(_log_parts(x, self), axis=1)

    def cdf(self, x) -> np.ndarray:
        """Distribution function at ``x`` (points,)."""
        return ndtr((np.asarray(x)[:, None] - self.mean) / self.sd) @ self.weight

    def quantile(self, shares) -> np.ndarray:
        """Quantiles at ``shares`` (shares,), by bisection."""
        shares = np.asarray(shares, float)
        low = np.full(shares.shape, float(np.min(self.mean - 40 * self.sd)))
        high = np.full(shares.shape, float(np.max(self.mean + 40 * self.sd)))
        for _ in range(60):
            middle = 0.5 * (low + high)
            below = self.cdf(middle) < shares
            low, high = np.where(below, middle, low), np.where(below, high, middle)
        return 0.5 * (low + high)

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation."""
        mean = float(self.weight @ self.mean)
        return mean, float(np.sqrt(self.weight @ (self.sd**2 + (self.mean - mean) ** 2)))


def fit_mixture(x, weight=None) -> Mixture:
    """The mixture of at most ``MOST`` components that the Bayesian information criterion prefers for draws ``x`` (draws,).

    ``weight`` (draws,) are importance weights up to a factor; by default all alike. Fitted by expectation maximisation from
    components that share the draws between them in order.
    """
    x = np.asarray(x, float)
    weight = np.ones(x.size) if weight is None else np.asarray(weight, float)
    share = weight / weight.sum()
    effective = 1.0 / np.sum(share**2)

    def criterion(count, height):
        return effective * height - 0.5 * (3 * count - 1) * np.log(effective)

    best, height = _maximised(x, share, 1)
    for count in range(2, MOST + 1):
        mixture, found = _maximised(x, share, count)
        if criterion(count, found) <= criterion(count - 1, height):
            break
        best, height = mixture, found
    return best


def _maximised(x, share, count) -> tuple[Mixture, float]:
    """The mixture of so many components and its mean log density over the draws."""
    mean = share @ x
    sd = np.sqrt(share @ (x - mean) ** 2) or 1e-12
    rank = np.cumsum(share[np.argsort(x)])[np.argsort(np.argsort(x))]
    owned = (np.minimum((rank * count).astype(int), count - 1)[:, None] == np.arange(count)).astype(float)
    last = -np.inf
    for _ in range(STEPS):
        mixture = _estimated(x, share, owned, NARROWEST * sd)
        parts = _log_parts(x, mixture)
        total = log_sum(parts, axis=1)
        height = float(share @ total)
        if height - last < GAIN:
            break
        last, owned = height, np.exp(parts - total[:, None])
    return mixture, height


def _estimated(x, share, owned, narrowest):
    mass = np.maximum(share @ owned, 1e-12)
    mean = (share * x) @ owned / mass
    variance = np.einsum("n,nk,nk->k", share, owned, (x[:, None] - mean) ** 2) / mass
    return Mixture(mass / mass.sum(), mean, np.sqrt(np.maximum(variance, narrowest**2)))


def log_sum(x, axis: int = -1) -> np.ndarray:
    """Log of the sum of exponentials along one axis; scipy's takes three times as long over what can be no infinity here."""
    top = x.max(axis=axis, keepdims=True)
    return np.squeeze(top, axis) + np.log(np.exp(x - top).sum(axis=axis))


def _log_parts(x, mixture):
    """Log of share times density of every component, (points, components)."""
    z = (np.asarray(x)[:, None] - mixture.mean) / mixture.sd
    return np.log(mixture.weight) - np.log(mixture.sd) - LOG_ROOT - 0.5 * z**2
