"""Proposal densities fitted to draws: a mixture of multivariate Student-t components."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaln, logsumexp

DEGREES = 8.0
BROAD_SHARE = 0.1
BROAD_STRETCH = 2.0
PARTS = (1, 4, 12)


@dataclass(frozen=True, eq=False)
class StudentMixture:
    """Mixture of Student-t densities: ``share`` (parts,), ``mean`` (parts, dimension), lower ``factor`` of each scale matrix."""

    share: np.ndarray
    mean: np.ndarray
    factor: np.ndarray
    degrees: float = DEGREES

    @classmethod
    def single(cls, mean, covariance) -> StudentMixture:
        """One component and a broad copy of it."""
        return cls.of(np.ones(1), np.asarray(mean)[None], np.asarray(covariance)[None])

    @classmethod
    def of(cls, share, mean, covariance, degrees=DEGREES) -> StudentMixture:
        """Components of the given moments, each with a broad copy that guards the tails."""
        ridge = 1e-9 * np.einsum("kii->ki", covariance)[:, :, None] * np.eye(mean.shape[1]) + 1e-14 * np.eye(mean.shape[1])
        factor = np.linalg.cholesky(covariance + ridge)
        return cls(
            np.concatenate([share * (1 - BROAD_SHARE), share * BROAD_SHARE]),
            np.concatenate([mean, mean]),
            np.concatenate([factor, BROAD_STRETCH * factor]),
            degrees,
        )

    def draw(self, rng, n: int) -> np.ndarray:
        """Draws of shape (n, dimension)."""
        part = rng.choice(self.share.size, size=n, p=self.share / self.share.sum())
        normal = rng.standard_normal((n, self.mean.shape[1]))
        stretch = np.sqrt(self.degrees / rng.chisquare(self.degrees, size=(n, 1)))
        return self.mean[part] + stretch * np.einsum("nij,nj->ni", self.factor[part], normal)

    def log_density(self, z) -> np.ndarray:
        """Log density at ``z`` (n, dimension), shape (n,)."""
        d, nu = self.mean.shape[1], self.degrees
        inverse = np.linalg.inv(self.factor)
        white = np.einsum("kij,nkj->nki", inverse, z[:, None, :] - self.mean)
        constant = gammaln((nu + d) / 2) - gammaln(nu / 2) - 0.5 * d * np.log(nu * np.pi)
        volume = np.log(np.einsum("kii->ki", self.factor)).sum(axis=1)
        parts = constant - volume - 0.5 * (nu + d) * np.log1p((white**2).sum(axis=2) / nu)
        return logsumexp(parts + np.log(self.share), axis=1)


def fit_mixture(draws, weights, rng, parts: int, sweeps: int = 25) -> StudentMixture:
    """Gaussian mixture by expectation-maximisation on weighted ``draws`` (n, dimension), given Student-t tails."""
    n, d = draws.shape
    centre = weights @ draws
    spread = np.sqrt(weights @ (draws - centre) ** 2) + 1e-12
    x = (draws - centre) / spread
    overall = (x * weights[:, None]).T @ x
    mean = x[rng.choice(n, parts, replace=False, p=weights)]
    covariance = np.repeat(overall[None], parts, axis=0)
    share = np.full(parts, 1 / parts)
    for _ in range(sweeps if parts > 1 else 1):
        if parts > 1:
            duty = _duty(x, share, mean, covariance) * weights[:, None]
        else:
            duty = weights[:, None]
        share = duty.sum(axis=0)
        mean = (duty.T @ x) / share[:, None]
        centred = x[:, None, :] - mean
        scatter = np.einsum("nk,nki,nkj->kij", duty, centred, centred, optimize=True)
        # A few draws of the overall shape keep small components from collapsing.
        guard = 2 * d / n
        covariance = (scatter + guard * overall / parts) / (share + guard / parts)[:, None, None]
    return StudentMixture.of(share / share.sum(), centre + spread * mean, covariance * np.outer(spread, spread))


def _duty(x, share, mean, covariance):
    lower = np.linalg.cholesky(covariance)
    white = np.einsum("kij,nkj->nki", np.linalg.inv(lower), x[:, None, :] - mean)
    volume = np.log(np.einsum("kii->ki", lower)).sum(axis=1)
    log_part = np.log(share) - volume - 0.5 * (white**2).sum(axis=2)
    return np.exp(log_part - logsumexp(log_part, axis=1, keepdims=True))


def importance(log_posterior, proposal: StudentMixture, rng, n: int):
    """Draws (n, dimension), their log posterior (n,) and normalised importance weights (n,)."""
    z = proposal.draw(rng, n)
    value = log_posterior(z)
    log_weight = value - proposal.log_density(z)
    weight = np.exp(log_weight - log_weight.max())
    return z, value, weight / weight.sum()


def effective_share(weight) -> float:
    """Effective share of importance draws, (Σw)² / (n Σw²)."""
    return float(1 / np.sum(weight**2) / weight.size)


def temper(weight, share):
    """Flatten weights until their effective share is at least ``share``."""
    log_weight = np.log(np.maximum(weight, 1e-300))
    power = 1.0
    while True:
        w = np.exp(power * (log_weight - log_weight.max()))
        w /= w.sum()
        if effective_share(w) >= min(share, 0.9) or power < 1e-3:
            return w
        power *= 0.8


def best_mixture(fitted, held_out, rng):
    """The mixture fitted to draws (n, dimension) that held-out walkers find most likely, and their mean log density."""
    fitted = fitted[rng.permutation(fitted.shape[0])[:3000]]
    even = np.full(fitted.shape[0], 1 / fitted.shape[0])
    tried = [fit_mixture(fitted, even, rng, parts) for parts in PARTS]
    scores = [float(np.mean(q.log_density(held_out))) for q in tried]
    return tried[int(np.argmax(scores))], max(scores)


def polish(log_posterior, proposal, rng, rounds: int = 3, n: int = 1024):
    """The best of ``proposal`` and its importance-weighted refits, with its effective share."""
    best, best_share = proposal, -1.0
    for k in range(rounds):
        z, _, weight = importance(log_posterior, proposal, rng, n)
        share = effective_share(weight)
        if share > best_share:
            best, best_share = proposal, share
        if k + 1 < rounds:
            proposal = fit_mixture(z, temper(weight, max(0.05, 5 * z.shape[1] / n)), rng, 1)
    return best, best_share
