"""The sampler's proposal: where the density of the log scales lies, from its slices or from draws of it."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.linalg import solve_triangular
from scipy.special import gammaln, logsumexp
from scipy.stats import t as student_t

SLICE = np.array([-7.0, -5.5, -4.5, -3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5, 4.5, 6.0])
"""Places, in standard deviations of the Laplace approximation, at which the density is sliced along each of its axes:
further down, where tails are longer."""
EDGES = np.linspace(SLICE[0], SLICE[-1], 401)
"""Cells in which a slice has one density."""
DOF, WIDE, FAR = 6.0, 1.2, 0.3
"""Degrees of freedom and width of the Student-t that proposes beyond them, and its share: with a tenth and a wider one walkers
stuck where the target was e⁴ times denser than the proposal."""
KERNELS = 256
"""Kernels of a learnt density, a sixth of the draws of a first run."""
LEAST_LOG = -50.0
"""Log density of a slice below its highest at which it is nothing."""


class Proposal:
    """A density like the target's, in standard deviations of the Laplace approximation about ``centre``: at first each axis of
    ``root`` has the density of the target's slice along it, for posteriors of log scales are skewed; once that is found wanting,
    the density is learnt from draws. Some points come from a wide Student-t."""

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
