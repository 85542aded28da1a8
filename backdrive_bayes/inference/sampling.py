"""Sampling with emcee: the only module that knows it.

Several independent ensembles start from an adapted approximation of the posterior and move by a mixture of an independence
proposal (Student-t) and differential evolution. R-hat and ESS are taken over ensembles, never over the walkers of one.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import emcee
import numpy as np
from emcee.moves import DEMove, Move
from scipy.special import gammaln

DEGREES = 6.0


@dataclass(frozen=True, eq=False)
class StudentT:
    """Multivariate Student-t: ``mean`` (dimension,), lower-triangular ``factor`` of its scale matrix."""

    mean: np.ndarray
    factor: np.ndarray
    degrees: float = DEGREES

    @functools.cached_property
    def _inverse(self):
        return np.linalg.inv(self.factor)

    @classmethod
    def fit(cls, draws, weights, degrees=DEGREES) -> StudentT:
        """Moments of weighted ``draws`` (n, dimension)."""
        mean = weights @ draws
        centred = draws - mean
        covariance = (centred * weights[:, None]).T @ centred
        ridge = 1e-10 * np.trace(covariance) / mean.size + 1e-14
        return cls(mean, np.linalg.cholesky(covariance + ridge * np.eye(mean.size)), degrees)

    def draw(self, rng, n: int) -> np.ndarray:
        """Draws of shape (n, dimension)."""
        normal = rng.standard_normal((n, self.mean.size))
        stretch = np.sqrt(self.degrees / rng.chisquare(self.degrees, size=(n, 1)))
        return self.mean + stretch * (normal @ self.factor.T)

    def log_density(self, z) -> np.ndarray:
        """Log density at ``z`` (n, dimension), shape (n,)."""
        d, nu = self.mean.size, self.degrees
        white = self._inverse @ (z - self.mean).T
        constant = gammaln((nu + d) / 2) - gammaln(nu / 2) - 0.5 * d * np.log(nu * np.pi)
        return constant - np.log(np.diag(self.factor)).sum() - 0.5 * (nu + d) * np.log1p((white**2).sum(axis=0) / nu)


class IndependenceMove(Move):
    """Proposes every walker anew from a fixed density that does not look at the ensemble (Metropolised independence)."""

    def __init__(self, proposal: StudentT):
        self.proposal = proposal

    def propose(self, model, state):
        """One step for all walkers; emcee's interface."""
        walkers = state.coords.shape[0]
        new = self.proposal.draw(model.random, walkers)
        log_prob, blobs = model.compute_log_prob_fn(new)
        ratio = log_prob - state.log_prob + self.proposal.log_density(state.coords) - self.proposal.log_density(new)
        accepted = np.log(model.random.random_sample(walkers)) < ratio
        moved = emcee.State(new, log_prob=log_prob, blobs=blobs)
        return self.update(state, moved, accepted), accepted


def importance(log_posterior, proposal: StudentT, rng, n: int):
    """Draws (n, dimension), their log posterior (n,) and normalised importance weights (n,)."""
    z = proposal.draw(rng, n)
    value = log_posterior(z)
    log_weight = value - proposal.log_density(z)
    weight = np.exp(log_weight - log_weight.max())
    return z, value, weight / weight.sum()


def effective_share(weight) -> float:
    """Effective share of importance draws, (Σw)² / (n Σw²)."""
    return float(1 / np.sum(weight**2) / weight.size)


@dataclass(frozen=True)
class Settings:
    """How long and how widely to sample; the defaults fit one unit of up to eight records."""

    ensembles: int = 4
    walkers: int = 64
    warm_up_block: int = 100
    warm_up_blocks: int = 12
    block: int = 60
    kept_per_ensemble: int = 1000
    max_seconds: float = 120.0
    good_share: float = 0.15


@dataclass(frozen=True, eq=False)
class Ensembles:
    """What the independent ensembles drew: ``z`` (ensembles, draws, dimension), kept evenly in time and walker by walker.

    ``halves`` (ensembles, draws) says whether a draw is from the first (0) or second half of the run.
    """

    z: np.ndarray
    log_posterior: np.ndarray
    halves: np.ndarray
    acceptance: float
    steps: int
    proposal: StudentT
    importance_share: float


def warm_up(log_posterior, mode, covariance, rng, settings: Settings):
    """A Student-t fitted to the posterior by importance sampling where that works, else by differential evolution.

    Returns the proposal, its effective importance share and the best point seen.
    """
    proposal = StudentT(mode, np.linalg.cholesky(covariance))
    walkers = _walkers(settings, mode.size)
    z, value, weight = importance(log_posterior, proposal, rng, 8 * walkers)
    start = z[rng.choice(z.shape[0], walkers, replace=False, p=_temper(weight, walkers * 3 / z.shape[0]))]
    share, best = effective_share(weight), z[np.argmax(value)]
    sampler = _sampler(walkers, mode.size, log_posterior, [(DEMove(), 0.9), (DEMove(gamma0=1.0), 0.1)], rng)
    state = emcee.State(start, log_prob=log_posterior(start), random_state=sampler.random_state)
    history = []
    for _ in range(settings.warm_up_blocks):
        if share >= settings.good_share:
            break
        sampler.reset()
        state = sampler.run_mcmc(state, settings.warm_up_block, skip_initial_state_check=True)
        history.append(sampler.get_chain(thin=5, flat=True))
        draws = np.concatenate(history[-max(1, len(history) // 2) :])
        trial = StudentT.fit(draws, np.full(draws.shape[0], 1 / draws.shape[0]))
        z, value, weight = importance(log_posterior, trial, rng, 4 * walkers)
        proposal, share = trial, effective_share(weight)
        best = state.coords[np.argmax(state.log_prob)]
    return proposal, share, best


def run_ensembles(log_posterior, proposal: StudentT, share, rng, settings: Settings, enough, deadline_s, clock):
    """Independent ensembles until ``enough(Ensembles)`` or the deadline; yields after every block of steps."""
    dimension, walkers = proposal.mean.size, _walkers(settings, proposal.mean.size)
    moves = [(IndependenceMove(proposal), 0.7), (DEMove(), 0.3)]
    samplers, states = [], []
    for _ in range(settings.ensembles):
        z, _, weight = importance(log_posterior, proposal, rng, 8 * walkers)
        start = z[rng.choice(z.shape[0], walkers, replace=False, p=_temper(weight, walkers * 3 / z.shape[0]))]
        sampler = _sampler(walkers, dimension, log_posterior, moves, rng)
        states.append(sampler.run_mcmc(start, settings.block // 2, skip_initial_state_check=True))
        sampler.reset()
        samplers.append(sampler)
    while True:
        states = [
            s.run_mcmc(x, settings.block, skip_initial_state_check=True) for s, x in zip(samplers, states, strict=True)
        ]
        drawn = _collect(samplers, proposal, share, settings.kept_per_ensemble)
        if enough(drawn) or clock() > deadline_s:
            return drawn


def _collect(samplers, proposal, share, kept):
    steps, walkers = samplers[0].iteration, samplers[0].nwalkers
    thin = max(1, int(np.ceil(steps * walkers / kept)))
    picked = np.arange(steps - 1 - thin * ((steps - 1) // thin), steps, thin)
    first = np.broadcast_to(picked < steps / 2, (walkers, picked.size)).ravel()
    z = np.stack([s.get_chain()[picked].swapaxes(0, 1).reshape(-1, s.ndim) for s in samplers])
    value = np.stack([s.get_log_prob()[picked].T.ravel() for s in samplers])
    halves = np.broadcast_to(np.where(first, 0, 1), value.shape)
    acceptance = float(np.mean([s.acceptance_fraction.mean() for s in samplers]))
    return Ensembles(z, value, halves, acceptance, steps, proposal, share)


def _walkers(settings, dimension):
    return max(settings.walkers, 2 * (dimension + 1))


def _sampler(walkers, dimension, log_posterior, moves, rng):
    sampler = emcee.EnsembleSampler(walkers, dimension, log_posterior, moves=moves, vectorize=True)
    # Unseeded samplers of one process share their random state: each gets its own.
    sampler.random_state = np.random.RandomState(rng.integers(2**31)).get_state()
    return sampler


def _temper(weight, share):
    """Flatten weights until their effective share is at least ``share``."""
    log_weight = np.log(np.maximum(weight, 1e-300))
    power = 1.0
    while True:
        w = np.exp(power * (log_weight - log_weight.max()))
        w /= w.sum()
        if effective_share(w) >= min(share, 0.9) or power < 1e-3:
            return w
        power *= 0.8
