"""From a unit to a posterior: reduce, find the mode, learn noise and discrepancy, sample until converged."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from backdrive_bayes.errors import BadInput
from backdrive_bayes.inference.chain_file import Unfinished
from backdrive_bayes.inference.covariance import local_slope
from backdrive_bayes.inference.diagnostics import Convergence, Outcome, diagnose_draws
from backdrive_bayes.inference.discrepancy import Discrepancy, learn_discrepancy
from backdrive_bayes.inference.noise_refinement import refine_noise
from backdrive_bayes.inference.optimum import Optimum, find_optimum
from backdrive_bayes.inference.problem import Problem, RecordData, path_within
from backdrive_bayes.inference.sampling import Ensembles, Settings, begin_ensembles, run_ensembles, warm_up
from backdrive_bayes.inference.starts import along_ridges, feature_starts, scattered, screened_starts, with_other_pasts
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import Scale
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.model.registry import BASELINE, members_named
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.faults import without_wild
from backdrive_bayes.records.noise import ChannelRecord, estimate_common_noise
from backdrive_bayes.records.record import Unit
from backdrive_bayes.records.reduction import reduce_record

BEND_NODES = 8
"""Points within a block at which the model's curvature is averaged."""
MOST_BLOCKS = 1200
"""Blocks of all records together beyond which each record gets fewer."""
BETTER_MODE = 5.0
"""Log posterior by which warm-up must beat the mode it started from for the fit to start again from there."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of one unit's parameters with all that is needed to turn them into loops.

    ``z`` (ensembles, draws, dimension) are coordinates of ``problem``; ``discrepancy_weights`` (ensembles, draws, terms)
    belong to the same draws. ``restarts`` (times, dimension) are the points at which the fit began again from a better mode.
    """

    unit: Unit
    problem: Problem
    discrepancy: Discrepancy
    ensembles: Ensembles
    discrepancy_weights: np.ndarray
    convergence: Convergence
    seed: int
    restarts: np.ndarray

    @property
    def z(self) -> np.ndarray:
        """All draws as one list, shape (draws, dimension)."""
        return self.ensembles.z.reshape(-1, self.problem.dimension)

    @property
    def weights(self) -> np.ndarray:
        """Discrepancy coefficients of the same draws, shape (draws, terms)."""
        return self.discrepancy_weights.reshape(self.z.shape[0], -1)

    @property
    def converged(self) -> bool:
        """Whether every parameter and indicator passed the diagnostics."""
        return self.convergence.outcome is Outcome.CONVERGED


@dataclass(frozen=True, eq=False)
class Prepared:
    """A problem ready to sample: mode, Laplace covariance and discrepancy."""

    problem: Problem
    optimum: Optimum
    discrepancy: Discrepancy


Quantities = Callable[[Problem, Discrepancy, np.ndarray, np.ndarray], dict[str, np.ndarray]]


def angle_scale_rad(unit: Unit) -> float:
    """Half the widest angle range of any record [rad], the scale of the priors."""
    return 0.5 * max(float(np.ptp(r.angle_rad)) for r in unit.records)


def prepare(unit: Unit, rng, baseline=BASELINE, scale: Scale | None = None, blocks_per_segment: int | None = None) -> Prepared:
    """Reduce the records, find the mode and learn noise and discrepancy; ``scale`` overrides the priors' scale."""
    unit = without_wild(unit)
    scale = scale or Scale(unit.rated_torque_nm, angle_scale_rad(unit))
    model = ReducerModel(_baseline_members(baseline), scale)
    # A loop from rest has two and a half legs.
    blocks_per_segment = blocks_per_segment or int(np.clip(MOST_BLOCKS / (2.5 * len(unit.records)), 60, 120))
    segments = [find_segments(r.time_s, r.torque_nm) for r in unit.records]
    noise = estimate_common_noise(
        [ChannelRecord(r.time_s, r.torque_nm, r.angle_rad, s) for r, s in zip(unit.records, segments, strict=True)]
    )
    blocks = [reduce_record(r, s, n, blocks_per_segment) for r, s, n in zip(unit.records, segments, noise, strict=True)]
    problem = Problem(model, tuple(RecordData.prepare(b, n) for b, n in zip(blocks, noise, strict=True)))
    optimum = find_optimum(problem, np.concatenate([screened_starts(problem, rng), feature_starts(problem, rng)]))
    starts = np.concatenate([[with_other_pasts(problem, optimum.z, rng)], scattered(optimum.z, rng)])
    optimum = find_optimum(problem, starts)
    return _refine(problem, optimum)


def _baseline_members(baseline):
    members = members_named(baseline)
    if not any(member.stage is Stage.COMPLIANCE for member in members):
        raise BadInput("--baseline", "a module that turns under torque among them, such as elastic", ",".join(baseline))
    return members


def _refine(problem, optimum) -> Prepared:
    """Noise told from discrepancy, torque noise through the slopes, then mode and discrepancy again."""
    problem = replace(problem, misfit=0.0)
    discrepancy = learn_discrepancy(problem, optimum)
    angles = [problem.model.angle(problem.values(optimum.z, r), d.path) for r, d in enumerate(problem.records)]
    slopes = [local_slope(d.blocks, angle) for d, angle in zip(problem.records, angles, strict=True)]
    noise, path_sd = refine_noise(problem, optimum.z, discrepancy, slopes)
    records = tuple(
        RecordData.prepare(corrected_blocks(problem, optimum.z, r, path_sd), n, s, problem.records[r].path)
        for r, (n, s) in enumerate(zip(noise, slopes, strict=True))
    )
    problem = replace(problem, records=records)
    optimum = find_optimum(problem, [optimum.z])
    discrepancy = learn_discrepancy(problem, optimum)
    problem = _no_quieter(replace(problem, misfit=discrepancy.misfit), optimum.z)
    return Prepared(problem, find_optimum(problem, [optimum.z]), discrepancy)


def _no_quieter(problem: Problem, z) -> Problem:
    """The problem with χ² raised to its expectation where the residual at the mode is smaller.

    The common noise factor that the likelihood infers rests on all blocks alike, intervals on the slow noise: a residual that is
    small in the many fast blocks must not make them narrower than the estimated noise says.
    """
    residual = np.concatenate(problem.residuals(z), axis=-1)
    lacking = problem.dof - problem.dimension - (residual @ residual - problem.misfit)
    return replace(problem, misfit=problem.misfit - max(float(lacking), 0.0))


def corrected_blocks(problem: Problem, z, record: int, path_sd: float = 0.0):
    """Blocks whose means are free of the model's curvature within a block, and with the torque path's extra error.

    The likelihood compares a block's mean angle with the angle at its mean torque; on the shoulders of a cliff they differ.
    """
    data = problem.records[record]
    blocks, values = data.blocks, problem.values(z, record)
    fine = path_within(blocks, data.path, BEND_NODES)
    # On a rough path the mean torque of the nodes is not quite the block's.
    mean = replace(data.path, torque_nm=fine.torque_nm.reshape(-1, BEND_NODES).mean(axis=1), within=None)
    bend = problem.model.angle(values, fine).reshape(-1, BEND_NODES).mean(axis=1) - problem.model.angle(values, mean)
    return replace(
        blocks,
        angle_rad=blocks.angle_rad - (bend - blocks.bend_rad),
        bend_rad=bend,
        torque_variance_nm2=np.maximum(blocks.torque_variance_nm2, path_sd**2),
    )


def fit(
    unit: Unit,
    *,
    baseline=BASELINE,
    seed: int = 0,
    settings: Settings | None = None,
    quantities: Quantities | None = None,
    scale: Scale | None = None,
    resume: Unfinished | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Posterior:
    """Posterior of one unit.

    ``quantities`` names further quantities of the draws (indicators) that must converge too. Sampling stops when every
    parameter and quantity has converged or the settings' budget is spent; the outcome says which. ``resume`` goes on with a fit
    of the same unit, baseline and seed whose budget was spent; BadInput where it is of another.
    """
    # The arrays are small: BLAS threads would spend their time waiting for each other.
    with threadpool_limits(1, user_api="blas"):
        return _fit(unit, baseline, seed, settings or Settings(), quantities, scale, resume, progress)


def _fit(unit, baseline, seed, settings, quantities, scale, resume, progress) -> Posterior:
    began = time.perf_counter()
    before = resume.seconds if resume else 0.0
    rng = np.random.default_rng(seed)

    def seconds_left() -> float:
        return began + settings.max_seconds - time.perf_counter()

    progress("reducing the records and finding the posterior mode")
    prepared = prepare(unit, rng, baseline, scale)
    if resume:
        prepared, chains, restarts = _resumed(prepared, resume)
    else:
        progress("warming up the ensembles")
        prepared, chains, restarts = _begun(prepared, rng, settings, seconds_left)
    problem, discrepancy = prepared.problem, prepared.discrepancy
    state: dict = {}

    def enough(drawn: Ensembles) -> bool:
        seconds = before + time.perf_counter() - began
        state["weights"] = _draw_weights(problem, discrepancy, drawn, seed)
        convergence = replace(diagnose_draws(problem.labels, drawn.z, drawn.step, seconds), burnt_in=drawn.burnt_in)
        if convergence.outcome is Outcome.CONVERGED and quantities is not None:
            names, values = _quantity_draws(problem, discrepancy, drawn, state["weights"], quantities)
            convergence = convergence.joined(diagnose_draws(names, values, drawn.step, seconds))
        state["convergence"] = convergence
        progress(_line(drawn, convergence))
        return convergence.outcome is Outcome.CONVERGED

    drawn = run_ensembles(problem.log_posterior, chains, rng, settings, enough, seconds_left)
    return Posterior(unit, problem, discrepancy, drawn, state["weights"], state["convergence"], seed, restarts)


def _begun(prepared, rng, settings, seconds_left):
    """The problem at the best mode that warm-up knows, its ensembles, and the points (times, dimension) of better modes."""
    restarts = []
    for _ in range(3):
        problem, optimum = prepared.problem, prepared.optimum
        starts = along_ridges(problem, optimum.z, rng) if seconds_left() > 0 else optimum.z[None]
        proposal, best = warm_up(problem.log_posterior, optimum.z, optimum.covariance, starts, rng, settings, seconds_left)
        if problem.log_posterior(best)[0] < optimum.log_posterior + BETTER_MODE:
            break
        restarts.append(best)
        prepared = _from_better_mode(prepared, best)
    chains = begin_ensembles(prepared.problem.log_posterior, proposal, rng, settings, seconds_left)
    return prepared, chains, np.reshape(restarts, (-1, prepared.problem.dimension))


def _resumed(prepared, resume):
    """The same three of a fit that has begun before."""
    for best in resume.restarts:
        prepared = _from_better_mode(prepared, best)
    return prepared, resume.chains(prepared.problem.log_posterior), resume.restarts


def _from_better_mode(prepared, best) -> Prepared:
    return _refine(prepared.problem, find_optimum(prepared.problem, [best]))


def _draw_weights(problem, discrepancy, drawn, seed):
    flat = drawn.z.reshape(-1, problem.dimension)
    return discrepancy.draw(problem, flat, np.random.default_rng([seed, 1])).reshape(*drawn.z.shape[:2], -1)


def _quantity_draws(problem, discrepancy, drawn, weights, quantities):
    flat = drawn.z.reshape(-1, problem.dimension)
    values = quantities(problem, discrepancy, flat, weights.reshape(flat.shape[0], -1))
    return list(values), np.stack([v.reshape(drawn.z.shape[:2]) for v in values.values()], axis=-1)


def _line(drawn, convergence):
    worst = np.nanmin(np.minimum(convergence.bulk_ess, convergence.tail_ess))
    return (
        f"step {drawn.steps}: R-hat at most {np.nanmax(convergence.rhat):.4f}, ESS at least {worst:.0f} "
        f"({convergence.worst}), acceptance {drawn.acceptance:.2f}"
    )
