"""Is the inference exact? Log marginal likelihoods against dense algebra, and the sampler against long plain emcee.

    python studies/exactness.py [--steps 1200] [--out reports/exactness]

One unit of known truth. Dense: the multivariate t of all block means, offsets taken out by an orthonormal basis, at draws of the
scales. Sampler: its draws (independence proposals that learn from all points evaluated, differential evolution beside them)
against emcee's stretch move alone, on the same marginal density, in the same run; and, where numpyro and dynesty are installed,
against NUTS, and a reduced case's evidence against nested sampling.
"""

from __future__ import annotations

import argparse
import importlib.util
import time
from dataclasses import dataclass
from pathlib import Path

import emcee
import numpy as np
from exactness_samplers import DIRECTIONS, evidence, marginal_in_jax, nuts
from scipy.linalg import block_diag, null_space
from scipy.stats import multivariate_t
from threadpoolctl import threadpool_limits

from backdrive_bayes.bench.known_truth import BenchNoise, physical_reducer, simulate_unit
from backdrive_bayes.engine import sample as engine
from backdrive_bayes.engine.diagnostics import diagnose_draws
from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import Scales, Whitened, find_scales, whiten

LOOPS = ((0.1, 0.01), (0.1, 0.05), (0.1, 0.1))
DENSE = 12
"""Points at which the dense algebra is done."""
BURN = 0.25


@dataclass(frozen=True)
class Run:
    """Draws (chains, draws, scales) in the order walker by walker, effective draws of each scale, evaluations and seconds."""

    draws: np.ndarray
    ess: np.ndarray
    rhat: float
    evaluations: int
    seconds: float

    @property
    def mean(self):
        return self.draws.reshape(-1, self.draws.shape[-1]).mean(axis=0)

    @property
    def sd(self):
        return self.draws.reshape(-1, self.draws.shape[-1]).std(axis=0)


@dataclass(frozen=True)
class Problem:
    """One unit's linear model with its scales at the mode."""

    linear: Linear
    data: Whitened
    """Every block at the full power of its likelihood: only then is there a covariance matrix to compare with."""
    scales: Scales
    mode: np.ndarray

    @property
    def names(self):
        return [n for n, free in zip(self.linear.design.names, self.scales.free, strict=True) if free]


def make_problem() -> Problem:
    known = physical_reducer(np.random.default_rng(0))
    linear = prepare(simulate_unit(known, LOOPS, BenchNoise(), np.random.default_rng(1)))[0]
    scales = linear.design.scales(levels(linear, ()))
    data = whiten(linear.design.records(), linear.angles, linear.covariances, linear.data.noise_dof)
    mode, _ = find_scales(data, scales)
    return Problem(linear, data, scales, mode)


def against_dense(problem: Problem, draws) -> np.ndarray:
    """Differences to the dense log marginal likelihood at draws of the scales, less their mean: whole data, compressed data."""
    linear, scales = problem.linear, problem.scales
    basis = null_space(block_diag(*(np.ones((1, a.size)) for a in linear.angles)))
    x, y = basis.T @ np.vstack(linear.design.records()), basis.T @ np.concatenate(linear.angles)
    noise = basis.T @ block_diag(*linear.covariances) @ basis
    small, turned = engine.compress(problem.data, scales, problem.mode)
    rows = []
    for point in draws:
        log_scale = problem.mode.copy()
        log_scale[scales.free] = point
        scale = scales.of_weights(log_scale)
        # Degrees of freedom need not be whole, whatever the library's stubs say.
        dense = multivariate_t.logpdf(y, None, noise + (x * scale**2) @ x.T, problem.data.noise_dof)  # type: ignore[arg-type]
        compressed = small.log_marginal(np.exp(log_scale)[turned.group])
        rows.append((problem.data.log_marginal(scale) - dense, compressed - dense))
    return np.array(rows) - np.mean(rows, axis=0)


def project_sampler(problem: Problem) -> Run:
    start = time.perf_counter()
    kept = engine.KEPT
    engine.KEPT = 10**9
    found = engine.sample(problem.data, problem.scales, problem.mode, problem.linear.design.names, 0)
    engine.KEPT = kept
    seconds, told = time.perf_counter() - start, found.convergence
    ess = np.minimum(told.bulk_ess, told.tail_ess)
    return Run(found.log_scale[..., problem.scales.free], ess, float(told.rhat.max()), told.evaluations, seconds)


def stretch_move(problem: Problem, steps: int) -> Run:
    """Four ensembles of emcee's default move on the compressed data, begun about the mode."""
    start = time.perf_counter()
    data, basis = engine.compress(problem.data, problem.scales, problem.mode)
    free = np.flatnonzero(problem.scales.free)
    target = engine._Target(data, basis.group, problem.scales, problem.mode)
    chains = []
    for chain in range(engine.ENSEMBLES):
        random = np.random.RandomState(chain)
        sampler = emcee.EnsembleSampler(engine.WALKERS, free.size, target, moves=emcee.moves.StretchMove(), vectorize=True)
        sampler.random_state = random.get_state()
        sampler.run_mcmc(problem.mode[free] + 0.3 * random.standard_normal((engine.WALKERS, free.size)), steps)
        chains.append(sampler.get_chain(discard=int(BURN * steps)))
    draws = np.stack([c.transpose(1, 0, 2).reshape(-1, free.size) for c in chains])
    when = np.stack([np.tile(np.arange(chains[0].shape[0]), engine.WALKERS)] * len(chains))
    told = diagnose_draws(problem.names, draws, when, target.evaluations)
    seconds = time.perf_counter() - start
    return Run(draws, np.minimum(told.bulk_ess, told.tail_ess), float(told.rhat.max()), target.evaluations, seconds)


def nuts_run(problem: Problem) -> Run:
    """NUTS on the same compressed data, compilation included."""
    data, basis = engine.compress(problem.data, problem.scales, problem.mode)
    free = np.flatnonzero(problem.scales.free)
    density = marginal_in_jax(data, basis.group, problem.scales, problem.mode, free)
    return Run(*nuts(density, problem.mode[free], problem.names))


def table(problem: Problem, ours: Run, plain: Run, other: str) -> list[str]:
    head = f"| log scale | mean, package | mean, {other} | apart, standard errors | sd, package | sd, {other} |"
    lines = [head, "|" + "---|" * 6]
    error = np.hypot(ours.sd / np.sqrt(ours.ess), plain.sd / np.sqrt(plain.ess))
    for k, name in enumerate(problem.names):
        apart = (ours.mean[k] - plain.mean[k]) / error[k]
        lines.append(
            f"| {name} | {ours.mean[k]:.3f} | {plain.mean[k]:.3f} | {apart:+.1f} | {ours.sd[k]:.3f} | {plain.sd[k]:.3f} |"
        )
    return lines


def cost(name, run: Run) -> str:
    least = run.ess.min()
    return (
        f"| {name} | {run.evaluations} | {run.seconds:.1f} | {run.rhat:.3f} | {least:.0f} | "
        f"{1e3 * least / run.evaluations:.2f} | {least / run.seconds:.1f} |"
    )


def others(problem: Problem, ours: Run) -> list[str]:
    """Sections on NUTS and on nested sampling, or which of them is not installed."""
    lines = []
    if importlib.util.find_spec("numpyro"):
        run = nuts_run(problem)
        times = ours.ess.min() / ours.seconds / (run.ess.min() / run.seconds)
        lines += ["## The package's sampler against NUTS", ""]
        lines += ["Gradients stand under evaluations, seconds hold the compilation.", ""]
        lines += [*table(problem, ours, run, "NUTS"), "", HEAD, "|" + "---|" * 7, cost("package", ours), cost("NUTS", run), ""]
        lines += [f"Least effective sample size for a second: {times:.1f} times that of NUTS.", ""]
    if importlib.util.find_spec("dynesty"):
        found = evidence(problem.linear)
        lines += [
            "## A reduced case against nested sampling", "",
            f"{DIRECTIONS} elastic weights, their scale and the noise scale, data drawn from them: log evidence "
            f"{found.engine:.2f} by the engine's algebra and one integral, {found.nested:.2f} ± {found.error:.2f} by nested "
            f"sampling ({found.evaluations} evaluations); {found.without_volume:.2f} with the determinant forgotten "
            "(planted fault).", "",
        ]  # fmt: skip
    missing = [name for name in ("numpyro", "dynesty") if not importlib.util.find_spec(name)]
    return lines + ([f"Not installed, hence not compared with: {', '.join(missing)}.", ""] if missing else [])


HEAD = "| sampler | evaluations | seconds | R-hat | least ESS | ESS a thousand evaluations | ESS a second |"


def report(problem: Problem, dense, ours: Run, plain: Run) -> str:
    whole, small = np.abs(dense).max(axis=0)
    per_evaluation = ours.ess.min() / ours.evaluations / (plain.ess.min() / plain.evaluations)
    per_second = ours.ess.min() / ours.seconds / (plain.ess.min() / plain.seconds)
    rows, weights = problem.data.x.shape
    lines = [
        "# Is the inference exact?", "",
        "Made by `python studies/exactness.py` in one run; seconds are those of one core of that machine, ratios carry over.", "",
        f"A unit of known truth: {len(LOOPS)} records, {rows} block means, {weights} weights, {len(problem.names)} log scales.",
        "", "## Log marginal likelihood against dense algebra", "",
        f"At {len(dense)} draws of the scales, largest difference from the multivariate t of all block means, constants aside:",
        f"{whole:.1e} with all columns, {small:.1e} with the compressed ones that are sampled.", "",
        "## The package's sampler against emcee's stretch move", "", *table(problem, ours, plain, "stretch"), "",
        HEAD, "|" + "---|" * 7,
        cost("package", ours), cost("stretch move", plain), "",
        f"Least effective sample size: {per_evaluation:.1f} times the stretch move's for an evaluation, "
        f"{per_second:.1f} times for a second (weights drawn, diagnostics included).", "",
    ]  # fmt: skip
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1200)
    parser.add_argument("--out", type=Path, default=Path("reports/exactness"))
    given = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):
        problem = make_problem()
        ours = project_sampler(problem)
        plain = stretch_move(problem, given.steps)
        points = ours.draws.reshape(-1, len(problem.names))
        chosen = points[np.linspace(0, len(points) - 1, DENSE).astype(int)]
        text = "\n".join([report(problem, against_dense(problem, chosen), ours, plain), *others(problem, ours)])
    given.out.mkdir(parents=True, exist_ok=True)
    (given.out / "README.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
