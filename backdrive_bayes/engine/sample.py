"""Sampling with emcee, the only module that knows it: log scales of the linear model, weights drawn exactly for each draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import emcee
import numpy as np
from emcee.moves import DEMove, Move

from backdrive_bayes.engine.diagnostics import MIN_ESS, Convergence, diagnose_draws
from backdrive_bayes.engine.marginal import LOG_SCALES, Known, Scales, Whitened
from backdrive_bayes.engine.proposal import Proposal

ENSEMBLES = 4
WALKERS = 32
INDEPENDENT = 0.9
"""Share of independent proposals; the others are differences of walkers, which find what the first leave out."""
FIRST_STEPS = 14
"""Steps before the first look: the ensembles then hold the draws that are kept."""
MOST_STEPS = 384
"""Steps in all, those included that better proposals made worthless."""
KEPT = 400
"""Draws kept of every ensemble."""


@dataclass(frozen=True, eq=False)
class Draws:
    """``log_scale`` (chains, draws, scales), ``weights`` (chains, draws, weights), ``log_density`` (chains, draws)."""

    log_scale: np.ndarray
    weights: np.ndarray
    log_density: np.ndarray
    acceptance: float
    convergence: Convergence


class _Independence(Move):
    """Proposes every walker anew (Metropolised independence)."""

    def __init__(self, proposal):
        self.proposal = proposal

    def propose(self, model, state):
        """One step for all walkers; emcee's interface."""
        new = self.proposal.draw(model.random, state.coords.shape[0])
        log_prob, blobs = model.compute_log_prob_fn(new)
        self.proposal.keep(new, log_prob)
        ratio = log_prob - state.log_prob + self.proposal.log_density(state.coords) - self.proposal.log_density(new)
        accepted = np.log(model.random.random_sample(new.shape[0])) < ratio
        return self.update(state, emcee.State(new, log_prob=log_prob, blobs=blobs), accepted), accepted


def sample(
    data: Whitened, scales: Scales, mode: np.ndarray, names, seed: int, note=lambda text: None, powers: Sequence[float] = (1.0,)
) -> Draws:
    """Draws of the log scales from their marginal posterior, and of the weights given each.

    ``mode`` (scales,) holds the log scales at the mode, fixed ones included; ``names`` are those of the scales.
    Weights are drawn from the likelihood raised to each of ``powers`` equally often; the scales always see all of it.
    """
    compressed, basis = compress(data, scales, mode)
    free = np.flatnonzero(scales.free)
    target = _Target(compressed, basis.group, scales, mode)
    root = _laplace_root(target, mode[free])
    samplers, convergence = _ensembles(target, mode[free], root, [names[i] for i in free], seed, note)
    drawn = np.stack([s.get_chain().reshape(-1, free.size) for s in samplers])
    density = np.stack([s.get_log_prob().ravel() for s in samplers])
    drawn, density = drawn[:, _thin(drawn)], density[:, _thin(drawn)]
    log_scale = np.broadcast_to(mode, (*drawn.shape[:2], mode.size)).copy()
    log_scale[..., free] = drawn
    rng, flat = np.random.default_rng([seed, ENSEMBLES]), log_scale.reshape(-1, mode.size)
    weights = draw_weights(compressed, basis, flat, ~scales.free, rng, powers).reshape(*drawn.shape[:2], -1)
    acceptance = float(np.mean([s.acceptance_fraction.mean() for s in samplers]))
    return Draws(log_scale, weights, density, acceptance, convergence)


def sample_density(target, centre: np.ndarray, root: np.ndarray, names, seed: int) -> tuple[np.ndarray, Convergence]:
    """Draws (chains, draws, dimension) of any log density and their convergence.

    ``target`` maps points (points, dimension) to log densities (points,) and counts its ``evaluations``; the first proposals
    are made about ``centre`` (dimension,) with the Cholesky factor ``root`` of their covariance.
    """
    samplers, convergence = _ensembles(target, centre, root, names, seed, lambda text: None)
    drawn = np.stack([s.get_chain().reshape(-1, centre.size) for s in samplers])
    return drawn[:, _thin(drawn)], convergence


def _ensembles(target, centre, root, names, seed, note):
    """Independent ensembles that have run until they converged or the budget was spent, and their convergence."""
    randoms = [np.random.RandomState(np.random.SeedSequence([seed, k]).generate_state(4)) for k in range(ENSEMBLES + 1)]
    proposal = Proposal(target, centre, root, randoms.pop())
    samplers, states = _begun(target, proposal, [random.get_state() for random in randoms])
    spent, steps = 0, FIRST_STEPS
    while True:
        states = [s.run_mcmc(x, steps, skip_initial_state_check=True) for s, x in zip(samplers, states, strict=True)]
        chains = [s.get_chain() for s in samplers]
        values = np.stack([c.transpose(1, 0, 2).reshape(-1, len(names)) for c in chains])
        length, spent = chains[0].shape[0], spent + steps
        when = np.tile(np.arange(length), WALKERS)
        convergence = diagnose_draws(names, values, np.stack([when] * ENSEMBLES), target.evaluations)
        note(f"{target.evaluations} evaluations: {convergence.line()}")
        if convergence.converged or spent >= MOST_STEPS:
            return samplers, convergence
        steps = max(FIRST_STEPS, length // 2)
        if proposal.improve(min(convergence.least_ess / MIN_ESS, 1.0)):
            samplers, states = _begun(target, proposal, [state.random_state for state in states])
            steps = FIRST_STEPS


def _begun(target, proposal, random_states):
    """Samplers and states of ensembles at points like draws of the target."""
    moves = [(_Independence(proposal), INDEPENDENT), (DEMove(), 1.0 - INDEPENDENT)]
    points, log_prob = proposal.starts(len(random_states) * WALKERS)
    parts = zip(np.split(points, len(random_states)), np.split(log_prob, len(random_states)), random_states, strict=True)
    states = [emcee.State(x, log_prob=p, random_state=random) for x, p, random in parts]
    return [emcee.EnsembleSampler(WALKERS, points.shape[1], target, moves=moves, vectorize=True) for _ in states], states


def _thin(drawn):
    return np.linspace(0, drawn.shape[1] - 1, min(KEPT, drawn.shape[1])).astype(int)


@dataclass(frozen=True, eq=False)
class Basis:
    """How compressed weights make the columns' own: ``turn`` (weights, compressed); ``rest`` (weights, left) are directions that
    the data do not see; ``group`` and ``rest_group`` number their scales."""

    turn: np.ndarray
    rest: np.ndarray
    group: np.ndarray
    rest_group: np.ndarray


SEEN = 0.04
"""Share of the noise below which a direction of the weights is not seen by the data: it moves log marginal
likelihoods by 1e-3."""
ABOVE = 1.5
"""How far above its mode a log scale may lie for that."""


def compress(data: Whitened, scales: Scales, mode: np.ndarray) -> tuple[Whitened, Basis]:
    """The same data with each group's weights turned to principal directions; what the data cannot see is set apart."""
    turn: list[np.ndarray] = []
    rest: list[np.ndarray] = []
    group: list[np.ndarray] = []
    rest_group: list[np.ndarray] = []
    for k in range(scales.mean.size):
        own = np.flatnonzero(scales.group == k)
        if not own.size:
            continue
        value, vector = np.linalg.eigh(data.gram[np.ix_(own, own)])
        widest = np.exp(min(mode[k] + ABOVE * (scales.sd[k] > 0), LOG_SCALES[1]))
        seen = widest**2 * value > SEEN**2
        for chosen, to, number in ((seen, turn, group), (~seen, rest, rest_group)):
            wide = np.zeros((data.x.shape[1], int(chosen.sum())))
            wide[own] = vector[:, chosen]
            to.append(wide)
            number.append(np.full(wide.shape[1], k))
    basis = Basis(np.hstack(turn), np.hstack(rest), np.concatenate(group), np.concatenate(rest_group))
    return Whitened(data.x @ basis.turn, data.y, data.samples, data.noise_dof), basis


def draw_weights(data: Whitened, basis: Basis, log_scale, fixed, rng, powers: Sequence[float] = (1.0,)) -> np.ndarray:
    """Exact draws (draws, weights) of the weights given log scales (draws, scales), of which those ``fixed`` (scales,) are the
    same in all draws; the likelihood is raised to each of ``powers`` equally often, in random order."""
    # Drawn in the columns' own weights: signs and turns of principal directions must not change what a seed gives.
    random, level = rng.standard_normal((log_scale.shape[0], basis.turn.shape[0])), np.arange(log_scale.shape[0]) % len(powers)
    rng.shuffle(level)
    found = np.empty_like(random)
    for k, power in enumerate(powers):
        own = level == k
        found[own] = _draw_coarsened(data.moments.coarsened(power), basis, log_scale[own], fixed, random[own].T, rng)
    return found


def _draw_coarsened(moments, basis, log_scale, fixed, random, rng) -> np.ndarray:
    """The same for one power, from standard normal ``random`` (weights, draws)."""
    by_group, held = np.exp(np.clip(log_scale, *LOG_SCALES)).T, fixed[basis.group]
    known = Known.of(moments, held, by_group[basis.group[held], 0])
    noise, spread = basis.turn.T @ random, np.empty(log_scale.shape[0])
    free, chance = by_group[basis.group[~held]], rng.chisquare(moments.dof, spread.size)
    # Walkers that stay where they are share their log scales: one factorisation serves all their draws.
    places, which = np.unique(log_scale, axis=0, return_inverse=True)
    for k in range(places.shape[0]):
        own = np.flatnonzero(which == k)
        free[:, own], spread[own] = known.left.draw(free[:, own[0]], noise[np.ix_(~held, own)], chance[own])
    turned = np.empty(noise.shape)
    turned[~held], turned[held] = free, known.given(free, noise[held] * spread)
    unseen = by_group[basis.rest_group] * (basis.rest.T @ random) * spread
    return (basis.turn @ turned + basis.rest @ unseen).T


LAPLACE_STEP = 0.15
"""Step of the difference quotients by a log scale."""
OUTSIDE = -1e30
"""Log density beyond the range of log scales."""
STACK = 16
"""Points evaluated at once: more would not stay in the processor's cache."""


class _Target:
    """Log posterior density of the free log scales, and how often it was evaluated."""

    def __init__(self, data, group, scales, mode):
        fixed = ~scales.free[group]
        self.moments = Known.of(data.moments, fixed, np.exp(mode[group[fixed]])).left
        self.group = (np.cumsum(scales.free) - 1)[group[~fixed]]
        self.mean, self.sd = scales.mean[scales.free], scales.sd[scales.free]
        self.evaluations = 0

    def __call__(self, points):
        """Densities (points,) at points (points, free scales)."""
        points = np.atleast_2d(points)
        self.evaluations += points.shape[0]
        prior = -0.5 * np.sum(((points - self.mean) / self.sd) ** 2, axis=1)
        scale = np.exp(np.clip(points, *LOG_SCALES))[:, self.group]
        parts = [self.moments.log_marginal(scale[k : k + STACK]) for k in range(0, points.shape[0], STACK)]
        inside = np.all((points >= LOG_SCALES[0]) & (points <= LOG_SCALES[1]), axis=1)
        return np.where(inside, np.concatenate(parts) + prior, OUTSIDE)


def _laplace_root(target, mode) -> np.ndarray:
    """Cholesky factor of the inverse Hessian at the mode, or as near to it as differences stay within the range of log scales,
    kept within the prior's width."""
    mode = np.clip(mode, LOG_SCALES[0] + 2.0 * LAPLACE_STEP, LOG_SCALES[1] - 2.0 * LAPLACE_STEP)
    rows, columns = np.tril_indices(mode.size)
    unit, hessian = LAPLACE_STEP * np.eye(mode.size), np.empty((mode.size, mode.size))
    ends = [target(mode + a * unit[rows] + b * unit[columns]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    hessian[rows, columns] = hessian[columns, rows] = -(ends[0] - ends[1] - ends[2] + ends[3]) / (4 * LAPLACE_STEP**2)
    value, vector = np.linalg.eigh(hessian)
    return np.linalg.cholesky((vector / np.maximum(value, 1.0 / np.max(target.sd) ** 2)) @ vector.T)
