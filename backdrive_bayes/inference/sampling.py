"""Sampling with emcee: the only module that knows it.

Several independent ensembles start from an adapted approximation of the posterior and move by a mixture of an independence
proposal (a Student-t mixture) and differential evolution. R-hat and ESS are taken over ensembles, never over the walkers of one.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import emcee
import h5py
import numpy as np
from emcee.backends import Backend, HDFBackend
from emcee.moves import DEMove, Move

from backdrive_bayes.inference.proposal import StudentMixture, best_mixture, importance, polish, temper

WORTHWHILE = 2.0
"""By how many nats a draw a refitted proposal must be better for the draws made so far to be given up."""

JITTER = 0.1
"""Posterior standard deviations by which walkers that set out from one point are set apart."""
TEMPERATURES = (64.0, 16.0, 4.0, 2.0)
"""Of the likelihood, through which the walkers cool, two blocks each: without it they stay on the part of a curved ridge where
they set out, and 90 % intervals of parameters that stand in for each other covered four fifths."""
LONGEST_COOLING = 0.3
"""Share of the budget that is left."""
LEAST_BLOCKS = 2
"""Blocks of differential evolution without which no proposal is believed: importance weights cannot see what it misses."""


CROWD_MOVES = [(DEMove(), 0.9), (DEMove(gamma0=1.0), 0.1)]
"""Differential evolution, with now and then a whole difference, which jumps between modes."""


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
    walkers: int = 256
    block: int = 40
    warm_up_blocks: int = 6
    refits: int = 2
    kept_per_ensemble: int = 1500
    burn_in_moves: float = 12.0
    longest_burn_in: int = 120
    max_seconds: float = 120.0
    good_share: float = 0.15


@dataclass(frozen=True, eq=False)
class Chains:
    """Ensembles at work: emcee's samplers, the proposal they move by, and how often it may still be refitted.

    ``burnt_in`` is whether there was time for the whole burn-in.
    """

    samplers: tuple[emcee.EnsembleSampler, ...]
    proposal: StudentMixture
    refits_left: int
    burnt_in: bool = True


@dataclass(frozen=True, eq=False)
class Ensembles:
    """What the independent ensembles drew: ``z`` (ensembles, draws, dimension), kept evenly in time and walker by walker.

    ``step`` (ensembles, draws) is the step at which each was drawn. ``chains`` can go on where time ran out, else None.
    """

    z: np.ndarray
    log_posterior: np.ndarray
    step: np.ndarray
    acceptance: float
    steps: int
    burnt_in: bool = True
    chains: Chains | None = None


def warm_up(log_posterior, mode, covariance, starts, rng, settings: Settings, seconds_left):
    """A proposal fitted to the posterior by importance sampling and differential evolution.

    ``starts`` (points, dimension) lie spread over the posterior's ridges, which the Gaussian at ``mode`` may not reach: half of
    the walkers set out from them. Returns the proposal and the best point of where the walkers are at the end.
    """
    proposal, share = polish(log_posterior, StudentMixture.single(mode, covariance), rng)
    walkers = _walkers(settings, mode.size)
    state, best = _starts(log_posterior, proposal, rng, walkers)
    if len(starts):
        # The first half, so that even and odd walkers, which a mixture is fitted to and judged by, are of both kinds.
        half = walkers // 2
        apart = JITTER * np.sqrt(np.diag(covariance)) * rng.standard_normal((half, mode.size))
        state[:half] = starts[rng.integers(len(starts), size=half)] + apart
    state = _cooled(log_posterior, state, rng, settings, seconds_left)
    sampler = _sampler(walkers, mode.size, log_posterior, CROWD_MOVES, rng)
    history = []
    for block in range(settings.warm_up_blocks):
        if (block >= LEAST_BLOCKS and share >= settings.good_share) or seconds_left() <= 0:
            break
        sampler.reset()
        state = sampler.run_mcmc(state, settings.block, skip_initial_state_check=True)
        history.append(sampler.get_chain(thin=4))
        recent = np.concatenate(history[len(history) // 2 :])
        one, other = (recent[:, half].reshape(-1, mode.size) for half in (slice(None, None, 2), slice(1, None, 2)))
        proposal, _ = best_mixture(one, other, rng)
        proposal, share = polish(log_posterior, proposal, rng, rounds=1)
        best = state.coords[np.argmax(state.log_prob)]
    return proposal, best


def _cooled(log_posterior, state, rng, settings, seconds_left):
    """Walkers (walkers, dimension) after differential evolution at falling temperatures."""

    def tempered(z, temperature):
        # The prior of the coordinates is standard normal; it stays as it is.
        log_prior = -0.5 * np.sum(z**2, axis=1)
        return log_prior + (log_posterior(z) - log_prior) / temperature

    enough = (1 - LONGEST_COOLING) * seconds_left()
    for temperature in TEMPERATURES:
        if seconds_left() <= max(enough, 0.0):
            break
        sampler = _sampler(*state.shape, partial(tempered, temperature=temperature), CROWD_MOVES, rng)
        state = sampler.run_mcmc(state, 2 * settings.block, skip_initial_state_check=True).coords
    return state


def _starts(log_posterior, proposal, rng, walkers):
    """Over-dispersed starting points (walkers, dimension) and the best point seen."""
    z, value, weight = importance(log_posterior, proposal, rng, 8 * walkers)
    picked = rng.choice(z.shape[0], walkers, replace=False, p=temper(weight, 3 / 8))
    return z[picked], z[np.argmax(value)]


def begin_ensembles(log_posterior, proposal: StudentMixture, rng, settings: Settings, seconds_left) -> Chains:
    """Independent ensembles with their burn-in behind them."""
    walkers = _walkers(settings, proposal.mean.shape[1])
    starts = [_starts(log_posterior, proposal, rng, walkers)[0] for _ in range(settings.ensembles)]
    return _begin(log_posterior, proposal, starts, settings.refits, rng, settings, seconds_left)


def run_ensembles(log_posterior, chains: Chains, rng, settings: Settings, enough, seconds_left) -> Ensembles:
    """Go on until ``enough(Ensembles)`` or until ``seconds_left()`` is zero.

    While they have not converged, the proposal is refitted to what they drew; where that makes it clearly better, all is drawn
    anew, so that adaptation never enters the draws that are kept.
    """
    steps = max(settings.block, chains.samplers[0].iteration // 2)
    while True:
        began = time.perf_counter()
        for sampler in chains.samplers:
            sampler.run_mcmc(None, steps, skip_initial_state_check=True)
        drawn = replace(_collect(chains.samplers, settings.kept_per_ensemble), burnt_in=chains.burnt_in)
        if enough(drawn):
            return drawn
        if seconds_left() <= 0:
            return replace(drawn, chains=chains)
        step_s = (time.perf_counter() - began) / steps
        chains = _refitted(log_posterior, chains, rng, settings, seconds_left)
        steps = max(10, min(max(steps, drawn.steps // 2), int(seconds_left() / step_s)))


def _refitted(log_posterior, chains, rng, settings, seconds_left):
    """The same chains, or new ones from where they stand: with a proposal that is clearly better, or for want of burn-in."""
    proposal, refits_left = chains.proposal, chains.refits_left
    if chains.burnt_in:
        flat = [s.get_chain(flat=True) for s in chains.samplers]
        held_out = np.concatenate(flat[1::2] or flat)
        held_out = held_out[:: max(1, held_out.shape[0] // 3000)]
        better, score = best_mixture(np.concatenate(flat[::2]), held_out, rng)
        # How likely the proposal finds the chain's own draws tells of regions that it misses; importance weights cannot.
        if not refits_left or score <= float(np.mean(proposal.log_density(held_out))) + WORTHWHILE:
            return chains
        proposal, refits_left = better, refits_left - 1
    states = [s.get_last_sample() for s in chains.samplers]
    return _begin(log_posterior, proposal, states, refits_left, rng, settings, seconds_left)


def _begin(log_posterior, proposal, states, refits_left, rng, settings, seconds_left):
    """Fresh samplers with their burn-in behind them, or as much of it as there is time for."""
    dimension = proposal.mean.shape[1]
    samplers = tuple(_sampler(_walkers(settings, dimension), dimension, log_posterior, _moves(proposal), rng) for _ in states)
    burnt_in = True
    for sampler, state in zip(samplers, states, strict=True):
        state = sampler.run_mcmc(state, settings.block // 2, skip_initial_state_check=True)
        # All ensembles start from the same approximation, so that R-hat cannot see a walker that has not left it yet.
        moves = settings.block // 2 * max(float(sampler.acceptance_fraction.mean()), 1e-3)
        rest = min(int(np.ceil((settings.burn_in_moves / moves - 1) * (settings.block // 2))), settings.longest_burn_in)
        while rest > 0 and seconds_left() > 0:
            state = sampler.run_mcmc(state, min(rest, settings.block // 2), skip_initial_state_check=True)
            rest -= settings.block // 2
        burnt_in = burnt_in and rest <= 0
        sampler.reset()
    return Chains(samplers, proposal, refits_left, burnt_in)


def _moves(proposal):
    return [(IndependenceMove(proposal), 0.7), (DEMove(), 0.25), (DEMove(gamma0=1.0), 0.05)]


def _collect(samplers, kept):
    steps, walkers = samplers[0].iteration, samplers[0].nwalkers
    thin = max(1, int(np.ceil(steps * walkers / kept)))
    picked = np.arange((steps - 1) % thin, steps, thin)
    z = np.stack([s.get_chain()[picked].swapaxes(0, 1).reshape(-1, s.ndim) for s in samplers])
    value = np.stack([s.get_log_prob()[picked].T.ravel() for s in samplers])
    step = np.broadcast_to(np.tile(picked, walkers), value.shape)
    acceptance = float(np.mean([s.acceptance_fraction.mean() for s in samplers]))
    return Ensembles(z, value, step, acceptance, steps)


def _walkers(settings, dimension):
    return max(settings.walkers, 2 * (dimension + 1))


def _sampler(walkers, dimension, log_posterior, moves, rng):
    sampler = emcee.EnsembleSampler(walkers, dimension, log_posterior, moves=moves, vectorize=True)
    # Unseeded samplers of one process share their random state: each gets its own.
    sampler.random_state = np.random.RandomState(rng.integers(2**31)).get_state()
    return sampler


def save_chains(chains: Chains, path: Path) -> None:
    """Add the ensembles to an HDF5 file, each a group as emcee's HDFBackend keeps it, and their proposal."""
    for k, sampler in enumerate(chains.samplers):
        drawn, kept = sampler.backend, HDFBackend(path, name=f"ensemble_{k}")
        kept.reset(*drawn.shape)
        kept.grow(drawn.iteration, None)
        # All steps at once: HDFBackend opens and closes its file at every step.
        with kept.open("a") as file:
            group = file[kept.name]
            group["chain"][...], group["log_prob"][...] = drawn.get_chain(), drawn.get_log_prob()
            group["accepted"][...] = drawn.accepted
            group.attrs.update({f"random_state_{i}": part for i, part in enumerate(drawn.random_state)})
            group.attrs["iteration"] = drawn.iteration
    with h5py.File(path, "a") as file:
        file.attrs.update(ensembles=len(chains.samplers), refits_left=chains.refits_left, burnt_in=chains.burnt_in)
        file.create_group("proposal").update(vars(chains.proposal))


def load_chains(path: Path, log_posterior) -> Chains:
    """Ensembles that go on where those of :func:`save_chains` stood; KeyError, OSError or ValueError where they cannot."""
    with h5py.File(path) as file:
        proposal = StudentMixture(**{name: part[()] for name, part in file["proposal"].items()})
        count, refits_left = int(file.attrs["ensembles"]), int(file.attrs["refits_left"])
        burnt_in = bool(file.attrs["burnt_in"])
    backends = [_in_memory(HDFBackend(path, name=f"ensemble_{k}", read_only=True)) for k in range(count)]
    samplers = [
        emcee.EnsembleSampler(*b.shape, log_posterior, moves=_moves(proposal), vectorize=True, backend=b) for b in backends
    ]
    return Chains(tuple(samplers), proposal, refits_left, burnt_in)


def _in_memory(kept: HDFBackend) -> Backend:
    drawn = Backend()
    drawn.reset(*kept.shape)
    drawn.chain, drawn.log_prob, drawn.accepted = kept.get_chain(), kept.get_log_prob(), kept.accepted
    drawn.iteration, drawn.random_state = int(kept.iteration), kept.random_state
    return drawn
