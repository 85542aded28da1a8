"""Sampling with emcee: the only module that knows it.

Several independent ensembles start from an adapted approximation of the posterior and move by a mixture of an independence
proposal (a Student-t mixture) and differential evolution. R-hat and ESS are taken over ensembles, never over the walkers of one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import emcee
import numpy as np
from emcee.moves import DEMove, Move

from backdrive_bayes.inference.proposal import StudentMixture, effective_share, fit_mixture, importance, temper

PARTS = (1, 4)
WORTHWHILE = 0.5
"""By how many nats a draw a refitted proposal must be better for the draws made so far to be given up."""


class IndependenceMove(Move):
    """Proposes every walker anew from a fixed density that does not look at the ensemble (Metropolised independence)."""

    def __init__(self, proposal: StudentMixture):
        self.proposal = proposal

    def propose(self, model, state):
        """One step for all walkers; emcee's interface."""
        walkers = state.coords.shape[0]
        new = self.proposal.draw(_Generator(model.random), walkers)
        log_prob, blobs = model.compute_log_prob_fn(new)
        ratio = log_prob - state.log_prob + self.proposal.log_density(state.coords) - self.proposal.log_density(new)
        accepted = np.log(model.random.random_sample(walkers)) < ratio
        moved = emcee.State(new, log_prob=log_prob, blobs=blobs)
        return self.update(state, moved, accepted), accepted


class _Generator:
    """emcee's legacy random state behind the few names of numpy's Generator that a proposal draws with."""

    def __init__(self, random):
        self.choice, self.chisquare, self.standard_normal = random.choice, random.chisquare, random.standard_normal


@dataclass(frozen=True)
class Settings:
    """How long and how widely to sample; the defaults fit one unit of up to eight records."""

    ensembles: int = 4
    walkers: int = 64
    block: int = 60
    warm_up_blocks: int = 6
    refits: int = 8
    kept_per_ensemble: int = 1000
    max_seconds: float = 120.0
    good_share: float = 0.15


@dataclass(frozen=True, eq=False)
class Ensembles:
    """What the independent ensembles drew: ``z`` (ensembles, draws, dimension), kept evenly in time and walker by walker.

    ``step`` (ensembles, draws) is the step at which each was drawn.
    """

    z: np.ndarray
    log_posterior: np.ndarray
    step: np.ndarray
    acceptance: float
    steps: int
    proposal: StudentMixture


def warm_up(log_posterior, mode, covariance, rng, settings: Settings, seconds_left):
    """A proposal fitted to the posterior: by importance sampling where that works, else by differential evolution.

    Returns the proposal and the best point seen.
    """
    proposal, share = _polish(log_posterior, StudentMixture.single(mode, covariance), rng)
    walkers = _walkers(settings, mode.size)
    state, best = _starts(log_posterior, proposal, rng, walkers)
    sampler = _sampler(walkers, mode.size, log_posterior, [(DEMove(), 0.9), (DEMove(gamma0=1.0), 0.1)], rng)
    history = []
    for _ in range(settings.warm_up_blocks):
        if share >= settings.good_share or seconds_left() <= 0:
            break
        sampler.reset()
        state = sampler.run_mcmc(state, settings.block, skip_initial_state_check=True)
        history.append(sampler.get_chain(thin=4))
        recent = np.concatenate(history[len(history) // 2 :])
        one, other = (recent[:, half].reshape(-1, mode.size) for half in (slice(None, None, 2), slice(1, None, 2)))
        proposal, _ = _refit(one, other, rng)
        proposal, share = _polish(log_posterior, proposal, rng, rounds=1)
        best = state.coords[np.argmax(state.log_prob)]
    return proposal, best


def _refit(fitted, held_out, rng):
    """The mixture fitted to draws (n, dimension) that held-out walkers find most likely, and their mean log density."""
    fitted = fitted[rng.permutation(fitted.shape[0])[:3000]]
    even = np.full(fitted.shape[0], 1 / fitted.shape[0])
    tried = [fit_mixture(fitted, even, rng, parts) for parts in PARTS]
    scores = [float(np.mean(q.log_density(held_out))) for q in tried]
    return tried[int(np.argmax(scores))], max(scores)


def _polish(log_posterior, proposal, rng, rounds: int = 3, n: int = 1024):
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


def _starts(log_posterior, proposal, rng, walkers):
    """Over-dispersed starting points (walkers, dimension) and the best point seen."""
    z, value, weight = importance(log_posterior, proposal, rng, 8 * walkers)
    picked = rng.choice(z.shape[0], walkers, replace=False, p=temper(weight, 3 / 8))
    return z[picked], z[np.argmax(value)]


def run_ensembles(log_posterior, proposal: StudentMixture, rng, settings: Settings, enough, seconds_left) -> Ensembles:
    """Independent ensembles until ``enough(Ensembles)`` or until ``seconds_left()`` is zero.

    While they have not converged, the proposal is refitted to what they drew; where that makes it clearly better, all is drawn
    anew, so that adaptation never enters the draws that are kept.
    """
    walkers = _walkers(settings, proposal.mean.shape[1])
    states = [_starts(log_posterior, proposal, rng, walkers)[0] for _ in range(settings.ensembles)]
    refits_left, steps = settings.refits, settings.block
    samplers, states = _begin(log_posterior, proposal, states, rng, settings)
    while True:
        began = time.perf_counter()
        states = [s.run_mcmc(x, steps, skip_initial_state_check=True) for s, x in zip(samplers, states, strict=True)]
        drawn = _collect(samplers, proposal, settings.kept_per_ensemble)
        if enough(drawn) or seconds_left() <= 0:
            return drawn
        affordable = int(seconds_left() * steps / (time.perf_counter() - began))
        steps = max(10, min(max(steps, drawn.steps // 2), affordable))
        chains = [s.get_chain(flat=True) for s in samplers]
        held_out = np.concatenate(chains[1::2] or chains)
        held_out = held_out[:: max(1, held_out.shape[0] // 3000)]
        better, score = _refit(np.concatenate(chains[::2]), held_out, rng)
        # How likely the proposal finds the chain's own draws tells of regions that it misses; importance weights cannot.
        if refits_left and score > float(np.mean(proposal.log_density(held_out))) + WORTHWHILE:
            refits_left -= 1
            proposal = better
            samplers, states = _begin(log_posterior, proposal, states, rng, settings)


def _begin(log_posterior, proposal, states, rng, settings):
    """Fresh samplers with their burn-in behind them."""
    moves = [(IndependenceMove(proposal), 0.7), (DEMove(), 0.25), (DEMove(gamma0=1.0), 0.05)]
    samplers = [_sampler(_walkers(settings, proposal.mean.shape[1]), proposal.mean.shape[1], log_posterior, moves, rng) for _ in states]
    burnt = [s.run_mcmc(x, settings.block // 2, skip_initial_state_check=True) for s, x in zip(samplers, states, strict=True)]
    for sampler in samplers:
        sampler.reset()
    return samplers, burnt


def _collect(samplers, proposal, kept):
    steps, walkers = samplers[0].iteration, samplers[0].nwalkers
    thin = max(1, int(np.ceil(steps * walkers / kept)))
    picked = np.arange((steps - 1) % thin, steps, thin)
    z = np.stack([s.get_chain()[picked].swapaxes(0, 1).reshape(-1, s.ndim) for s in samplers])
    value = np.stack([s.get_log_prob()[picked].T.ravel() for s in samplers])
    step = np.broadcast_to(np.tile(picked, walkers), value.shape)
    acceptance = float(np.mean([s.acceptance_fraction.mean() for s in samplers]))
    return Ensembles(z, value, step, acceptance, steps, proposal)


def _walkers(settings, dimension):
    return max(settings.walkers, 2 * (dimension + 1))


def _sampler(walkers, dimension, log_posterior, moves, rng):
    sampler = emcee.EnsembleSampler(walkers, dimension, log_posterior, moves=moves, vectorize=True)
    # Unseeded samplers of one process share their random state: each gets its own.
    sampler.random_state = np.random.RandomState(rng.integers(2**31)).get_state()
    return sampler
