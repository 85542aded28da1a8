"""Sampling with emcee, the only module that knows it: log scales of the linear model, weights drawn exactly for each draw."""

from __future__ import annotations

from dataclasses import dataclass

import emcee
import numpy as np
from emcee.moves import DEMove, Move
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solve_triangular
from scipy.special import gammaln, logsumexp
from scipy.stats import t as student_t

from backdrive_bayes.engine.diagnostics import Convergence, diagnose_draws
from backdrive_bayes.engine.marginal import LOG_SCALES, Known, Scales, Whitened

ENSEMBLES = 4
WALKERS = 32
SLICE = np.array([-7.0, -5.5, -4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5, 6.0])
"""Places, in standard deviations of the Laplace approximation, at which the density is sliced along each of its axes."""
EDGES = np.linspace(SLICE[0], SLICE[-1], 401)
"""Cells in which a slice has one density."""
DOF, WIDE, FAR = 6.0, 1.2, 0.3
"""Degrees of freedom and width of the Student-t that proposes beyond the slices, and its share."""
INDEPENDENT = (0.9, 0.6)
"""Share of independent proposals at first and once they learn; the others are differences of walkers, which find what the first
leave out."""
KERNELS, LEARNT = 256, 9
"""Kernels by which draws teach the proposal, and how often they do."""
SETTLING, FIRST_STEPS = 2, 13
MOST_STEPS = 384
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
    """Proposes every walker anew (Metropolised independence), in standard deviations of the Laplace approximation about
    ``centre``: at first each axis of ``root`` has the density of the target's slice along it, for posteriors of log scales are
    skewed; once that is found wanting, the density is learnt from draws. Some points come from a wide Student-t."""

    def __init__(self, target, centre, root):
        self.centre, self.root = centre, root
        self.shape = _Slices(target, centre, root)

    def learn(self, draws):
        """Take the place, the width and the shape of ``draws`` (draws, dimension) from now on."""
        covariance = np.cov(draws, rowvar=False).reshape(self.root.shape)
        self.centre, self.root = draws.mean(axis=0), np.linalg.cholesky(covariance + 1e-9 * np.diag(np.diag(covariance)))
        self.shape = _Kernels(self._standard(draws))

    def _standard(self, x):
        return solve_triangular(self.root, (x - self.centre).T, lower=True, check_finite=False).T

    def log_density(self, x):
        """Log density up to a constant, (walkers,)."""
        z = self._standard(x)
        wide = (student_t.logpdf(z / WIDE, DOF) - np.log(WIDE)).sum(axis=1)
        return np.logaddexp(np.log(1.0 - FAR) + self.shape.log_density(z), np.log(FAR) + wide)

    def draw(self, random, count):
        """Points (count, dimension)."""
        shaped, wide = self.shape.draw(random, count), WIDE * random.standard_t(DOF, (count, self.centre.size))
        return self.centre + np.where(random.random_sample((count, 1)) < FAR, wide, shaped) @ self.root.T

    def propose(self, model, state):
        """One step for all walkers; emcee's interface."""
        new = self.draw(model.random, state.coords.shape[0])
        log_prob, blobs = model.compute_log_prob_fn(new)
        ratio = log_prob - state.log_prob + self.log_density(state.coords) - self.log_density(new)
        accepted = np.log(model.random.random_sample(new.shape[0])) < ratio
        return self.update(state, emcee.State(new, log_prob=log_prob, blobs=blobs), accepted), accepted


class _Slices:
    """Product of the target's slices along the axes of ``root`` through ``centre``."""

    def __init__(self, target, centre, root):
        value = target((centre + SLICE[:, None, None] * root.T).reshape(-1, centre.size)).reshape(SLICE.size, -1)
        middle = 0.5 * (EDGES[1:] + EDGES[:-1])
        log = PchipInterpolator(SLICE, np.maximum(value - value.max(axis=0), LEAST_LOG))(middle)
        self.log = log - logsumexp(log, axis=0)
        self.share = np.vstack([np.zeros(centre.size), np.exp(self.log).cumsum(axis=0)])

    def log_density(self, z):
        cell = np.searchsorted(EDGES, z) - 1
        inside = np.all((cell >= 0) & (cell < self.log.shape[0]), axis=1)
        log = np.take_along_axis(self.log, np.clip(cell, 0, self.log.shape[0] - 1), axis=0) - np.log(EDGES[1] - EDGES[0])
        return np.where(inside, log.sum(axis=1), -np.inf)

    def draw(self, random, count):
        chance = random.random_sample((count, self.share.shape[1]))
        return np.stack([np.interp(c, share, EDGES) for c, share in zip(chance.T, self.share.T, strict=True)], axis=1)


class _Kernels:
    """Kernel density of standardised points (points, dimension): Student-t kernels of Silverman's width.

    Source: Silverman, Density Estimation, 1986, section 4.3.2.
    """

    def __init__(self, points):
        self.at = points[np.linspace(0, len(points) - 1, min(KERNELS, len(points))).astype(int)]
        count, size = self.at.shape
        self.width = (4.0 / (size + 2.0) / count) ** (1.0 / (size + 4.0))
        constant = gammaln(0.5 * (DOF + size)) - gammaln(0.5 * DOF) - 0.5 * size * np.log(np.pi * DOF)
        self.constant = constant - size * np.log(self.width) - np.log(count)

    def log_density(self, z):
        square = np.sum((z[:, None, :] - self.at) ** 2, axis=2) / self.width**2
        return self.constant + logsumexp(-0.5 * (DOF + z.shape[1]) * np.log1p(square / DOF), axis=1)

    def draw(self, random, count):
        spread = self.width * np.sqrt(DOF / random.chisquare(DOF, (count, 1)))
        at = self.at[random.randint(len(self.at), size=count)]
        return at + spread * random.standard_normal(at.shape)


def sample(
    data: Whitened, scales: Scales, mode: np.ndarray, names, seed: int, note=lambda text: None, power: float = 1.0
) -> Draws:
    """Draws of the log scales from their marginal posterior, and of the weights given each.

    ``mode`` (scales,) holds the log scales at the mode, fixed ones included; ``names`` are those of the scales.
    Weights are drawn from the likelihood raised to ``power``; the scales always see all of it.
    """
    compressed, basis = compress(data, scales, mode)
    free = np.flatnonzero(scales.free)
    target = _Target(compressed, basis.group, scales, mode)
    move = _Independence(target, mode[free], _laplace_root(target, mode[free]))
    samplers, convergence = _ensembles(target, move, [names[i] for i in free], seed, note)
    drawn = np.stack([s.get_chain().reshape(-1, free.size) for s in samplers])
    density = np.stack([s.get_log_prob().ravel() for s in samplers])
    drawn, density = drawn[:, _thin(drawn)], density[:, _thin(drawn)]
    log_scale = np.broadcast_to(mode, (*drawn.shape[:2], mode.size)).copy()
    log_scale[..., free] = drawn
    rng, flat = np.random.default_rng([seed, ENSEMBLES]), log_scale.reshape(-1, mode.size)
    weights = draw_weights(compressed, basis, flat, ~scales.free, rng, power).reshape(*drawn.shape[:2], -1)
    acceptance = float(np.mean([s.acceptance_fraction.mean() for s in samplers]))
    return Draws(log_scale, weights, density, acceptance, convergence)


def sample_density(target, centre: np.ndarray, root: np.ndarray, names, seed: int) -> tuple[np.ndarray, Convergence]:
    """Draws (chains, draws, dimension) of any log density and their convergence.

    ``target`` maps points (points, dimension) to log densities (points,) and counts its ``evaluations``; the first proposals
    are made about ``centre`` (dimension,) with the Cholesky factor ``root`` of their covariance.
    """
    samplers, convergence = _ensembles(target, _Independence(target, centre, root), names, seed, lambda text: None)
    drawn = np.stack([s.get_chain().reshape(-1, centre.size) for s in samplers])
    return drawn[:, _thin(drawn)], convergence


def _ensembles(target, move, names, seed, note):
    """Independent ensembles that have run until they converged or the budget was spent, and their convergence."""

    def sampler(random_state, share):
        moves = [(move, share), (DEMove(), 1.0 - share)]
        made = emcee.EnsembleSampler(WALKERS, len(names), target, moves=moves, vectorize=True)
        made.random_state = random_state
        return made

    samplers, starts, steps, learnt = [], [], FIRST_STEPS, 0
    for chain in range(ENSEMBLES):
        random = np.random.RandomState(np.random.SeedSequence([seed, chain]).generate_state(4))
        samplers.append(sampler(random.get_state(), INDEPENDENT[0]))
        starts.append(samplers[-1].run_mcmc(move.draw(random, WALKERS), SETTLING, skip_initial_state_check=True))
        samplers[-1].reset()
    while True:
        starts = [s.run_mcmc(x, steps, skip_initial_state_check=True) for s, x in zip(samplers, starts, strict=True)]
        chains = [s.get_chain() for s in samplers]
        values = np.stack([c.transpose(1, 0, 2).reshape(-1, len(names)) for c in chains])
        length = chains[0].shape[0]
        when = np.tile(np.arange(length), WALKERS)
        convergence = diagnose_draws(names, values, np.stack([when] * ENSEMBLES), target.evaluations)
        note(f"{target.evaluations} evaluations: {convergence.line()}")
        if convergence.converged or length >= MOST_STEPS:
            return samplers, convergence
        steps = max(FIRST_STEPS, length // 2)
        if learnt < LEARNT:
            # Draws under one proposal teach the next, which must not count them.
            move.learn(values.reshape(-1, len(names)))
            steps, learnt = FIRST_STEPS + learnt, learnt + 1
            samplers = [sampler(s.random_state, INDEPENDENT[1]) for s in samplers]


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


SEEN = 0.05
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


def draw_weights(data: Whitened, basis: Basis, log_scale, fixed, rng, power: float = 1.0) -> np.ndarray:
    """Exact draws (draws, weights) of the weights given log scales (draws, scales), of which those ``fixed`` (scales,) are the
    same in all draws; the likelihood is raised to ``power``."""
    by_group = np.exp(np.clip(log_scale, *LOG_SCALES)).T
    moments, held = data.moments.coarsened(power), fixed[basis.group]
    known = Known.of(moments, held, by_group[basis.group[held], 0])
    # Drawn in the columns' own weights: signs and turns of principal directions must not change what a seed gives.
    random = rng.standard_normal((basis.turn.shape[0], log_scale.shape[0]))
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
OUTSIDE, LEAST_LOG = -1e30, -50.0
"""Log density beyond the range of log scales, and the least of a slice below its highest."""
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
    """Cholesky factor of the inverse Hessian at the mode, kept within the prior's width."""
    rows, columns = np.tril_indices(mode.size)
    unit, hessian = LAPLACE_STEP * np.eye(mode.size), np.empty((mode.size, mode.size))
    ends = [target(mode + a * unit[rows] + b * unit[columns]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    hessian[rows, columns] = hessian[columns, rows] = -(ends[0] - ends[1] - ends[2] + ends[3]) / (4 * LAPLACE_STEP**2)
    value, vector = np.linalg.eigh(hessian)
    return np.linalg.cholesky((vector / np.maximum(value, 1.0 / np.max(target.sd) ** 2)) @ vector.T)
