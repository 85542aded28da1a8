"""Other people's samplers on the engine's own densities: NUTS of numpyro, nested sampling of dynesty (neither is a dependency).

Used by studies/exactness.py where they are installed: ``pip install numpyro dynesty``.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.special import gammaln, ndtri
from scipy.stats import chi2 as chi_square

from backdrive_bayes.engine.diagnostics import diagnose_draws
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import Whitened, whiten

CHAINS, WARM_UP, KEPT = 4, 400, 1000
DIRECTIONS = 6
"""Weights of the reduced case: principal directions of the elastic columns."""
SCALE = (float(np.log(0.5)), 1.0)
LIVE = 400
REACH = 8.0


def nuts(log_density, start: np.ndarray, names, seed: int = 0):
    """Draws (chains, draws, dimension), their effective number and R-hat, gradients and seconds, compilation included.

    ``log_density`` is a function of a jax array (dimension,); chains begin about ``start``.
    """
    import jax

    jax.config.update("jax_enable_x64", True)
    from numpyro.infer import MCMC, NUTS

    began, random = time.perf_counter(), np.random.default_rng(seed)
    kernel = NUTS(potential_fn=lambda x: -log_density(x), dense_mass=True)
    run = MCMC(kernel, num_warmup=WARM_UP, num_samples=KEPT, num_chains=CHAINS, chain_method="sequential", progress_bar=False)
    first = start + 0.3 * random.standard_normal((CHAINS, start.size))
    run.warmup(jax.random.PRNGKey(seed), init_params=first, extra_fields=("num_steps",), collect_warmup=True)
    steps = int(np.sum(run.get_extra_fields()["num_steps"]))
    run.run(jax.random.PRNGKey(seed + 1), extra_fields=("num_steps",))
    steps += int(np.sum(run.get_extra_fields()["num_steps"]))
    draws = np.asarray(run.get_samples(group_by_chain=True), float)
    told = diagnose_draws(names, draws, np.tile(np.arange(draws.shape[1]), (CHAINS, 1)), steps)
    return draws, np.minimum(told.bulk_ess, told.tail_ess), float(told.rhat.max()), steps, time.perf_counter() - began


def marginal_in_jax(data: Whitened, group, scales, mode, free):
    """The log posterior density of the free log scales as jax computes it, for :func:`nuts`."""
    import jax
    import jax.numpy as jnp
    from jax.scipy.linalg import solve_triangular

    jax.config.update("jax_enable_x64", True)
    gram, moment = jnp.asarray(data.gram), jnp.asarray(data.moment)
    mean, sd = jnp.asarray(scales.mean[free]), jnp.asarray(scales.sd[free])

    def log_density(point):
        scale = jnp.exp(jnp.asarray(mode).at[free].set(point))[group]
        lower = jnp.linalg.cholesky(gram * jnp.outer(scale, scale) + jnp.eye(scale.size))
        seen = solve_triangular(lower, scale * moment, lower=True)
        left = jnp.log1p((data.total - seen @ seen) / data.noise_dof)
        prior = -0.5 * jnp.sum(((point - mean) / sd) ** 2)
        return -0.5 * (data.noise_dof + data.samples) * left - jnp.log(jnp.diag(lower)).sum() + prior

    return log_density


@dataclass(frozen=True)
class Evidence:
    """Log evidences of the reduced case: the engine's, nested sampling's with its error, and the planted fault's."""

    engine: float
    nested: float
    error: float
    without_volume: float
    evaluations: int


def evidence(linear: Linear, seed: int = 0) -> Evidence:
    """Log evidence of a few weights, their scale and the noise scale: algebra and one integral against nested sampling.

    Block means are drawn from the unit's elastic columns and noise; offsets are taken out as the engine does.
    """
    import dynesty

    random = np.random.default_rng(seed)
    elastic = linear.design.index == linear.design.names.index("elastic")
    columns = [x[:, elastic] for x in linear.design.records()]
    weights = np.exp(SCALE[0]) * random.standard_normal(int(elastic.sum()))
    angles = [x @ weights + np.linalg.cholesky(c) @ random.standard_normal(len(c))
              for x, c in zip(columns, linear.covariances, strict=True)]
    data = whiten(columns, angles, linear.covariances, linear.data.noise_dof)
    turn = np.linalg.svd(data.x, full_matrices=False)[2][:DIRECTIONS].T
    x, dof, size = data.x @ turn, data.noise_dof, data.samples
    small = Whitened(x, data.y, size, dof)
    constant = gammaln(0.5 * (dof + size)) - gammaln(0.5 * dof) - 0.5 * size * np.log(np.pi * dof)
    calls = [0]

    def log_likelihood(point):
        calls[0] += 1
        variance = dof / chi_square.isf(point[1], dof)
        left = data.y - x @ (np.exp(SCALE[0] + SCALE[1] * point[0]) * np.sqrt(variance) * point[2:])
        return -0.5 * size * np.log(2 * np.pi * variance) - 0.5 * float(left @ left) / variance

    def from_cube(cube):
        found = ndtri(cube)
        found[1] = cube[1]
        return found

    sampler = dynesty.NestedSampler(log_likelihood, from_cube, DIRECTIONS + 2, nlive=LIVE, rstate=random, sample="rslice")
    sampler.run_nested(print_progress=False)
    result = sampler.results
    whole, bare = (_over_scale(small, volume) + constant for volume in (True, False))
    return Evidence(whole, float(result.logz[-1]), float(result.logzerr[-1]), bare, calls[0])


def _over_scale(data: Whitened, volume: bool) -> float:
    """Log of the marginal likelihood averaged over the prior of the scale; without ``volume`` the determinant is forgotten."""

    def value(t):
        scale = np.full(data.x.shape[1], np.exp(SCALE[0] + SCALE[1] * t))
        forgotten = 0.0 if volume else 0.5 * np.linalg.slogdet(np.eye(scale.size) + data.gram * np.outer(scale, scale))[1]
        return data.log_marginal(scale) + forgotten - 0.5 * t**2 - 0.5 * np.log(2 * np.pi)

    top = max(value(t) for t in np.linspace(-REACH, REACH, 201))
    return top + float(np.log(quad(lambda t: np.exp(value(t) - top), -REACH, REACH, limit=400)[0]))
