"""The sampler's proposal: a density like the target's, learnt from every point at which the target was evaluated."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solve_triangular
from scipy.special import gammaln, logsumexp

SLICE = np.array([-7.0, -5.5, -4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5, 6.0])
"""Places, in standard deviations of the Laplace approximation, at which the density is sliced along each of its axes:
further down, where tails are longer."""
EDGES = np.linspace(SLICE[0], SLICE[-1], 401)
"""Cells in which a slice has one density."""
LEAST_LOG = -50.0
"""Log density of a slice below its highest at which it is nothing."""
POWERS = (1.0, 0.25, 0.0625)
"""Powers of the slices for the first points: two and four times as wide, they find shoulders far from the mode."""
BATCH = 256
"""Points at which each first or learnt proposal is tried: they tell an efficiency of a half to a sixteenth of it."""
EFFICIENT = 0.5
"""Efficiency that is enough: 400 effective draws then take a thousand."""
LEARNT = 12
"""How often the proposal learns before sampling at most; units whose scales trade for each other want up to eight."""
COMPONENTS, DOF, ROUNDS = 3, 8.0, 12
"""Student-t components of a learnt proposal, their degrees of freedom, and rounds of expectation and maximisation. One holds a
single peak; two of three a peak and its shoulder; six or ten are no better."""
NARROW = 0.5
"""Width of a component that no points speak for, in standard deviations of all points, with the weight of one point more than
there are dimensions: components are parts of the whole."""
WIDE, FAR = 2.0, 0.1
"""Width and share of the Student-t that proposes beyond what was found: its share is what it may cost of the efficiency."""


class Proposal:
    """At first the target's slices along the axes of its Laplace approximation, for posteriors of log scales are skewed; where
    these leave something out, a mixture fitted to all points so far, weighed by target over what proposed them.

    Source: Cappé, Douc, Guillin, Marin and Robert, Statistics and Computing 18, 2008, 447-459 (mixtures by weights); Cornuet,
    Marin, Mira and Robert, Scandinavian Journal of Statistics 39, 2012, 798-812 (points of all proposals together).
    """

    def __init__(self, target, centre, root, random):
        self.random = random
        self.points, self.log_target = np.empty((0, centre.size)), np.empty(0)
        slices = _sliced(target, centre, root)
        self.stages = [_Stage(centre, root, _Slices(power * slices)) for power in POWERS]
        self._waiting = []
        for stage in self.stages:
            self._evaluate(target, stage)
        self._weigh()
        while self.efficiency.max() < EFFICIENT and len(self.stages) < LEARNT:
            self._learn()
            self._evaluate(target, self.stages[-1])
            self._weigh()
        self.now = self.stages[int(self.efficiency.argmax())]

    def log_density(self, x) -> np.ndarray:
        """Log density (points,) at ``x`` (points, dimension), up to a constant that stays until the proposal improves."""
        return self.now.log_density(x)

    def draw(self, random, count: int) -> np.ndarray:
        """Points (count, dimension)."""
        return self.now.draw(random, count)

    def keep(self, points, log_target) -> None:
        """Learn later from ``points`` (points, dimension) that it proposed and the target's log density (points,) there."""
        self._waiting.append((self.now, points, log_target))

    def improve(self, done: float) -> bool:
        """Learn from all points so far; whether that makes a proposal with which to begin anew is shorter than to go on, where a
        share ``done`` of the effective draws is there."""
        before = self.now
        self._weigh()
        self._learn()
        self._weigh()
        chosen, old = int(self.efficiency.argmax()), self.efficiency[self.stages.index(before)]
        if self.efficiency[chosen] * (1.0 - done) > old:
            self.now = self.stages[chosen]
        return self.now is not before

    def starts(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Points (count, dimension) like draws of the target, and its log density there."""
        at = self.random.choice(self.weight.size, count, p=self.weight)
        return self.points[at], self.log_target[at]

    def _evaluate(self, target, stage):
        points = stage.draw(self.random, BATCH)
        self._waiting.append((stage, points, target(points)))

    def _weigh(self):
        """Weights of all points, as if drawn from all proposals together, and every proposal's efficiency: effective draws of the
        target for one of its own."""
        for stage, points, log_target in self._waiting:
            self.points, self.log_target = np.vstack([self.points, points]), np.append(self.log_target, log_target)
            stage.count += len(points)
        self._waiting = []
        own = np.stack([stage.log_density(self.points) for stage in self.stages])
        with np.errstate(divide="ignore"):
            share = np.log([[stage.count / len(self.points)] for stage in self.stages])
        log = self.log_target - logsumexp(own + share, axis=0)
        total = logsumexp(log)
        self.weight = np.exp(log - total)
        # The mean of target over proposal under the target, whose normalisation the same points tell.
        self.efficiency = np.exp(2.0 * total - np.log(len(log)) - logsumexp(self.log_target - own + log, axis=1))

    def _learn(self):
        """Add the proposal that the weighted points ask for."""
        weight = _spread_out(self.weight, 4 * self.points.shape[1] + 16)
        centre = weight @ self.points
        apart = self.points - centre
        covariance = (apart.T * weight) @ apart
        root = np.linalg.cholesky(covariance + 1e-9 * np.diag(np.diag(covariance)))
        seen = weight > 1e-6 * weight.max()
        z = solve_triangular(root, apart[seen].T, lower=True, check_finite=False).T
        self.stages.append(_Stage(centre, root, _Mixture.fitted(z, weight[seen] / weight[seen].sum(), self.random)))


def _spread_out(weight, least):
    """Weights raised to the highest power up to one that leaves ``least`` effective points."""
    log = np.log(np.maximum(weight, 1e-300))
    for power in np.linspace(1.0, 0.0, 41):
        raised = np.exp(power * (log - log.max()))
        if raised.sum() ** 2 >= least * (raised @ raised):
            break
    return raised / raised.sum()


class _Stage:
    """A shape in standard deviations about a centre, and some points from a wide Student-t; ``count`` points are of it."""

    def __init__(self, centre, root, shape):
        self.centre, self.root, self.shape, self.count = centre, root, shape, 0
        self.log_volume = np.log(np.diag(root)).sum()
        self.wide = _Mixture(np.ones(1), np.zeros((1, centre.size)), WIDE * np.eye(centre.size)[None])

    def log_density(self, x):
        z = solve_triangular(self.root, (x - self.centre).T, lower=True, check_finite=False).T
        shape, wide = self.shape.log_density(z), self.wide.log_density(z)
        return np.logaddexp(np.log(1.0 - FAR) + shape, np.log(FAR) + wide) - self.log_volume

    def draw(self, random, count):
        shaped, wide = self.shape.draw(random, count), self.wide.draw(random, count)
        return self.centre + np.where(random.random_sample((count, 1)) < FAR, wide, shaped) @ self.root.T


def _sliced(target, centre, root):
    """Log densities (cells, dimension) of the target along the axes of ``root`` through ``centre``."""
    value = target((centre + SLICE[:, None, None] * root.T).reshape(-1, centre.size)).reshape(SLICE.size, -1)
    return PchipInterpolator(SLICE, np.maximum(value - value.max(axis=0), LEAST_LOG))(0.5 * (EDGES[1:] + EDGES[:-1]))


class _Slices:
    """Product of one-dimensional densities with the logarithms ``log`` (cells, dimension)."""

    def __init__(self, log):
        self.log = log - logsumexp(log, axis=0)
        self.share = np.vstack([np.zeros(log.shape[1]), np.exp(self.log).cumsum(axis=0)])

    def log_density(self, z):
        cell = np.searchsorted(EDGES, z) - 1
        inside = np.all((cell >= 0) & (cell < self.log.shape[0]), axis=1)
        log = np.take_along_axis(self.log, np.clip(cell, 0, self.log.shape[0] - 1), axis=0) - np.log(EDGES[1] - EDGES[0])
        return np.where(inside, log.sum(axis=1), -np.inf)

    def draw(self, random, count):
        chance = random.random_sample((count, self.share.shape[1]))
        return np.stack([np.interp(c, share, EDGES) for c, share in zip(chance.T, self.share.T, strict=True)], axis=1)


class _Mixture:
    """Student-t components: ``share`` (components,), ``at`` (components, dimension), ``roots`` of their scale matrices."""

    def __init__(self, share, at, roots):
        self.share, self.at, self.roots = share, at, roots
        size = at.shape[1]
        volume = np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(axis=1)
        normal = gammaln(0.5 * (DOF + size)) - gammaln(0.5 * DOF) - 0.5 * size * np.log(np.pi * DOF)
        self.constant, self.inverse = normal - volume + np.log(share), np.linalg.inv(roots)

    @classmethod
    def fitted(cls, z, weight, random) -> _Mixture:
        """Fit to points (points, dimension) with ``weight`` (points,) by expectation and maximisation, begun at some of them."""
        size, effective = z.shape[1], 1.0 / (weight @ weight)
        unit, prior = np.eye(size), size + 1.0
        at = z[random.choice(len(z), COMPONENTS, p=weight)]
        found = cls(np.full(COMPONENTS, 1.0 / COMPONENTS), at, np.stack([unit] * COMPONENTS))
        for _ in range(ROUNDS):
            log, square = found._parts(z)
            own = np.exp(log - logsumexp(log, axis=0)) * weight
            pull = own * (DOF + size) / (DOF + square) + 1e-12 * weight
            at = (pull @ z) / pull.sum(axis=1, keepdims=True)
            apart = z - at[:, None, :]
            share = np.maximum(own.sum(axis=1), 1e-3)
            spread = effective * np.einsum("kn,kni,knj->kij", pull, apart, apart, optimize=True) + prior * NARROW**2 * unit
            roots = np.linalg.cholesky(spread / (effective * share + prior)[:, None, None])
            found = cls(share / share.sum(), at, roots)
        return found

    def _parts(self, z):
        """Log densities and squared distances of every component, (components, points)."""
        square = np.sum((self.inverse @ (z - self.at[:, None, :]).transpose(0, 2, 1)) ** 2, axis=1)
        return self.constant[:, None] - 0.5 * (DOF + z.shape[1]) * np.log1p(square / DOF), square

    def log_density(self, z):
        return logsumexp(self._parts(z)[0], axis=0)

    def draw(self, random, count):
        which = random.choice(self.share.size, count, p=self.share)
        step = random.standard_normal((count, self.at.shape[1])) * np.sqrt(DOF / random.chisquare(DOF, (count, 1)))
        return self.at[which] + np.einsum("nij,nj->ni", self.roots[which], step)
