"""Speed, side by side in one run: sampling efficiency, and CSV to indicators against raw least squares.

    python studies/speed.py --out reports/speed

On one record's posterior, minimum bulk ESS per second of this package against emcee's default move vectorised on the same reduced
likelihood, emcee with a per-walker Python likelihood on the raw samples, and numpyro's NUTS (where numpyro is installed).
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import argparse
import json
import resource
import time
import warnings
from dataclasses import replace
from pathlib import Path

import emcee
import numpy as np
from arviz_stats.base import array_stats
from scipy.optimize import least_squares
from scipy.signal import lfilter

from backdrive_bayes.indicators.summary import indicators_json, monitored
from backdrive_bayes.inference.fit import fit, prepare
from backdrive_bayes.inference.problem import path_of
from backdrive_bayes.inference.sampling import Settings, begin_ensembles, run_ensembles, warm_up
from backdrive_bayes.inference.starts import along_ridges
from backdrive_bayes.model.path import Leg, TorquePath
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.unit_folder import read_unit

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data" / "twins"


def min_ess(draws) -> float:
    """Smallest bulk ESS of draws (chains, draws, parameters)."""
    return float(np.min(array_stats.ess(draws, chain_axis=0, draw_axis=1, method="bulk")))


def walker_ess(chain) -> float:
    """Smallest ESS of an emcee chain (steps, walkers, parameters) by its integrated autocorrelation time."""
    tau = emcee.autocorr.integrated_time(chain, quiet=True, tol=0)
    return float(chain.shape[0] * chain.shape[1] / np.nanmax(tau))


def ours(problem, optimum, seconds=20.0):
    """Warm-up and sampling of this package until the time is up: ESS per second with and without warm-up."""
    rng = np.random.default_rng(0)
    began = time.perf_counter()
    starts = along_ridges(problem, optimum.z, rng)
    proposal, _ = warm_up(problem.log_posterior, optimum.z, optimum.covariance, starts, rng, Settings(), lambda: 1e9)
    warm = time.perf_counter() - began
    # Without thinning, so that nothing the sampler has drawn is thrown away.
    settings = Settings(kept_per_ensemble=10**6, refits=1)
    began = time.perf_counter()
    chains = begin_ensembles(problem.log_posterior, proposal, rng, settings, lambda: 1e9)
    drawn = run_ensembles(
        problem.log_posterior, chains, rng, settings, lambda e: False, lambda: began + seconds - time.perf_counter()
    )
    run = time.perf_counter() - began
    ess = min_ess(drawn.z)
    return {"min_ess": ess, "warm_up_s": warm, "run_s": run, "ess_per_s": ess / (run + warm),
            "ess_per_s_sampling": ess / run, "acceptance": drawn.acceptance}


def default_move(problem, optimum, steps=6000):
    """emcee's stretch move, vectorised, on the same reduced posterior and from the same start."""
    rng = np.random.default_rng(1)
    sampler = emcee.EnsembleSampler(64, problem.dimension, problem.log_posterior, vectorize=True)
    sampler.random_state = np.random.RandomState(1).get_state()
    start = optimum.z + rng.standard_normal((64, problem.dimension)) @ np.linalg.cholesky(optimum.covariance).T
    state = sampler.run_mcmc(start, steps // 4)
    sampler.reset()
    began = time.perf_counter()
    sampler.run_mcmc(state, steps)
    run = time.perf_counter() - began
    ess = walker_ess(sampler.get_chain())
    return {"min_ess": ess, "run_s": run, "ess_per_s": ess / run, "evaluations_per_ess": 64 * steps / ess}


def raw_path(record, blocks) -> TorquePath:
    """The reduced torque path interpolated to every raw sample."""
    segments = find_segments(record.time_s, record.torque_nm)
    torque = np.interp(record.time_s, blocks.mid_s, blocks.torque_nm)
    legs = tuple(Leg(s.start, s.stop, s.direction, e.end_torque_nm) for s, e in zip(segments, path_of(blocks).legs, strict=True))
    return TorquePath(torque, record.time_s, path_of(blocks).start_torque_nm, legs)


def raw_log_posterior(problem, record):
    """A plain per-walker Python likelihood on raw samples, whitened by the steady-state filter of the noise."""
    data = problem.records[0]
    path, noise = raw_path(record, data.blocks), data.noise
    step = float(np.median(np.diff(record.time_s)))
    phi = np.exp(-step / noise.correlation_time_s)
    drive, white = noise.correlated_rad**2 * (1 - phi**2), noise.white_rad**2
    variance = drive
    for _ in range(1000):
        variance = phi**2 * variance * white / (variance + white) + drive
    gain = variance / (variance + white)

    def log_posterior(z):
        residual = record.angle_rad - problem.model.angle(problem.values(z, 0), path)
        residual = residual - residual.mean()
        # Innovations of the Kalman filter in steady state: an ARMA(1, 1) inverse.
        innovation = lfilter([1.0, -phi], [1.0, -phi * (1 - gain)], residual)
        return -0.5 * innovation @ innovation / (variance + white) - 0.5 * z @ z

    return log_posterior


def per_walker_python(problem, record, optimum, evaluations_per_ess):
    """Time of one raw evaluation; ESS per second at the default move's evaluations per effective draw."""
    log_posterior = raw_log_posterior(problem, record)
    log_posterior(optimum.z)
    began, n = time.perf_counter(), 0
    while time.perf_counter() - began < 3.0:
        log_posterior(optimum.z)
        n += 1
    seconds = (time.perf_counter() - began) / n
    return {"seconds_per_evaluation": seconds, "ess_per_s": 1 / (seconds * evaluations_per_ess),
            "note": "default move: measured time of one evaluation times the default move's evaluations per effective draw"}


def numpyro_nuts(problem, optimum, warm=200, draws=300):
    """NUTS on the same reduced posterior, compilation in and out."""
    try:
        import jax
        import numpyro
    except ImportError:
        return None
    jax.config.update("jax_enable_x64", True)
    potential = _jax_potential(problem)
    began = time.perf_counter()
    kernel = numpyro.infer.NUTS(potential_fn=potential, dense_mass=True, max_tree_depth=7)
    options = {"num_chains": 2, "chain_method": "sequential", "progress_bar": False}
    mcmc = numpyro.infer.MCMC(kernel, num_warmup=warm, num_samples=draws, **options)
    start = np.stack([optimum.z, optimum.z + 0.1 * np.sqrt(np.diag(optimum.covariance))])
    mcmc.run(jax.random.PRNGKey(0), init_params=jax.numpy.asarray(start))
    z = np.asarray(mcmc.get_samples(group_by_chain=True))
    whole = time.perf_counter() - began
    began = time.perf_counter()
    mcmc.run(jax.random.PRNGKey(1), init_params=jax.numpy.asarray(start))
    np.asarray(mcmc.get_samples())
    compiled = time.perf_counter() - began
    ess = min_ess(z)
    return {"min_ess": ess, "seconds": whole, "ess_per_s": ess / whole, "ess_per_s_compiled": ess / compiled}


def _jax_potential(problem):
    """The reduced log posterior of a one-record problem with the baseline model, in JAX."""
    import jax.numpy as jnp
    from jax.scipy.stats import norm

    from backdrive_bayes.model.friction import CONSTANT_SHARES, LOAD_RATIOS, _bank
    from backdrive_bayes.model.parameter import BoundedLogNormal, LogNormal, LogUniform, Uniform

    data, rated = problem.records[0], problem.model.scale.torque_nm
    bank = _bank(data.path, rated, 0)
    names, path = [c.parameter.name for c in problem.coordinates], data.path
    padded = np.zeros((bank.past.shape[0], path.torque_nm.size))
    padded[:, : bank.past.shape[1]] = bank.past
    neutral, torque, direction = jnp.asarray(bank.neutral), jnp.asarray(path.torque_nm), jnp.asarray(path.direction)
    priors = [c.parameter.scaled_prior(problem.model.scale) for c in problem.coordinates]

    def hats(nodes, mean, spread):
        positive = jnp.asarray(nodes[1:])
        s = (jnp.log(positive) - jnp.log(mean)) / spread
        zero = jnp.zeros(1)
        mass = jnp.concatenate([zero, norm.cdf(s + 0.5 * spread)])
        moment = mean * jnp.concatenate([zero, norm.cdf(s - 0.5 * spread)])
        rise = (jnp.diff(moment) - nodes[:-1] * jnp.diff(mass)) / np.diff(nodes)
        w = jnp.zeros(len(nodes)).at[1:].add(rise).at[:-1].add(jnp.diff(mass) - rise)
        return w.at[-1].add(1 - mass[-1])

    def angle(v):
        w = jnp.outer(hats(CONSTANT_SHARES, v["friction_torque"] / rated, v["friction_spread"]),
                      hats(LOAD_RATIOS, v["friction_ratio"], v["load_spread"])).ravel()
        w = ((1 - v["free_share"]) * w).at[0].add(v["free_share"])
        start = v["initial_friction_state"]
        past = jnp.concatenate([w * jnp.maximum(start, 0), w * jnp.maximum(-start, 0)])
        passed = w @ neutral + past @ jnp.asarray(padded)
        ratio, knee = v["hardening_ratio"], v["hardening_torque"]
        elastic = v["compliance"] * (ratio * passed + (1 - ratio) * knee * jnp.tanh(passed / knee))
        drag, release = v["drag_torque"], v["release_torque"]
        release = v["release_width_ratio"] * drag * release / (drag + release)

        def rising(x):
            late, width = v["late_share"], v["engagement_torque"]
            e = v["release_share"] * (1 - late)
            early = jnp.tanh((x - drag) / width)
            second = jnp.tanh((x - drag * v["late_drag_ratio"]) / (v["late_width_ratio"] * width))
            back = jnp.tanh((x + release) / (v["release_width_ratio"] * width))
            return (1 - e) * ((1 - late) * early + late * second) + e * back

        bound = rising(direction * torque) * direction
        low, high = rising(path.start_torque_nm), -rising(-path.start_torque_nm)

        def played(state):
            legs = []
            for leg in path.legs:
                hold = jnp.maximum if leg.direction > 0 else jnp.minimum
                legs.append(hold(state, bound[leg.start : leg.stop]))
                state = hold(state, rising(leg.direction * leg.end_torque_nm) * leg.direction)
            return jnp.concatenate(legs)

        place, spread = 0.5 * (1 + v["initial_gap_position"]), v["initial_gap_spread"]
        gap = (1 - spread) * played(low + place * (high - low)) + spread * ((1 - place) * played(low) + place * played(high))
        return elastic + 0.5 * v["clearance"] * gap

    def physical_value(prior, z):
        match prior:
            case Uniform(lo, hi):
                return lo + (hi - lo) * norm.cdf(z)
            case LogUniform(lo, hi):
                return lo * (hi / lo) ** norm.cdf(z)
            case BoundedLogNormal(median, sd, hi):
                return hi / (1 + (hi / median - 1) * jnp.exp(-sd * z))
            case LogNormal(median, sd):
                return median * jnp.exp(sd * z)

    whitener, measured = jnp.asarray(data.whitener), jnp.asarray(data.blocks.angle_rad)

    def potential(z):
        physical = [physical_value(prior, z[i]) for i, prior in enumerate(priors)]
        residual = whitener @ (measured - angle(dict(zip(names, physical, strict=True))))
        chi2 = jnp.maximum(residual @ residual - problem.misfit, 0.0)
        return 0.5 * (problem.noise_dof + problem.dof) * jnp.log1p(chi2 / problem.noise_dof) + 0.5 * z @ z

    check = np.array([float(-potential(jnp.asarray(z))) for z in (np.zeros(len(names)), 0.3 * np.ones(len(names)))])
    own = problem.log_posterior(np.array([np.zeros(len(names)), 0.3 * np.ones(len(names))]))
    assert np.allclose(np.diff(check), np.diff(own), rtol=1e-6), "the JAX copy is another posterior"
    return potential


def pipeline(folder, file):
    """CSV to indicators with converged intervals, against reading and raw least squares from a generic start."""
    began = time.perf_counter()
    unit = read_unit(folder)
    unit = replace(unit, records=tuple(r for r in unit.records if r.name == file))
    reading = time.perf_counter() - began
    record = unit.records[0]
    posterior = fit(unit, seed=0, quantities=monitored(0.03), settings=Settings(max_seconds=120))
    indicators_json(posterior, 0.03)
    whole = time.perf_counter() - began
    problem = posterior.problem
    path = raw_path(record, problem.records[0].blocks)

    def residual(z):
        r = record.angle_rad - problem.model.angle(problem.values(z, 0), path)
        return np.concatenate([(r - r.mean()) / problem.records[0].noise.correlated_rad, z])

    began = time.perf_counter()
    least_squares(residual, np.zeros(problem.dimension), max_nfev=100)
    raw = time.perf_counter() - began
    return {"rows": int(record.time_s.size), "converged": posterior.converged, "reading_s": reading, "csv_to_indicators_s": whole,
            "raw_least_squares_s": raw, "ratio_to_raw_plus_reading": whole / (raw + reading)}


def evaluation_cost(problem):
    """Milliseconds of one evaluation for 64 walkers, and per thousand reduced samples."""
    z = 0.1 * np.random.default_rng(0).standard_normal((64, problem.dimension))
    problem.log_posterior(z)
    began = time.perf_counter()
    for _ in range(50):
        problem.log_posterior(z)
    ms = (time.perf_counter() - began) / 50 * 1e3
    blocks = problem.dof + 1
    return {"blocks": blocks, "ms_64_walkers": ms, "ms_per_thousand_blocks_and_walker": ms / 64 / blocks * 1e3}


def main():
    """Command line."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("reports/speed"))
    options = parser.parse_args()
    result = {"cores": os.cpu_count(), "posteriors": {}, "pipelines": []}
    jobs = (("reducer-1", "rate-0.01-amp-0.1.csv.gz"), ("unit-38", "rate-0.05-amp-3.csv.gz"))
    for name, file in jobs:
        unit = read_unit(SHARED / name)
        unit = replace(unit, records=tuple(r for r in unit.records if r.name == file))
        prepared = prepare(unit, np.random.default_rng(0))
        problem, optimum = prepared.problem, prepared.optimum
        rows = {"ours": ours(problem, optimum), "emcee default, vectorised, reduced": default_move(problem, optimum)}
        need = rows["emcee default, vectorised, reduced"]["evaluations_per_ess"]
        rows["emcee default, Python per walker, raw"] = per_walker_python(problem, unit.records[0], optimum, need)
        rows["numpyro NUTS"] = numpyro_nuts(problem, optimum)
        rows["ratios"] = {k: rows["ours"]["ess_per_s"] / v["ess_per_s"] for k, v in rows.items() if k != "ours" and v}
        result["posteriors"][f"{name}/{file}"] = rows | {"evaluation": evaluation_cost(problem)}
        print(json.dumps(result["posteriors"][f"{name}/{file}"], indent=1), flush=True)
    for name, file in jobs:
        result["pipelines"].append(pipeline(SHARED / name, file))
        print(json.dumps(result["pipelines"][-1]), flush=True)
    result["peak_memory_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "speed.json").write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
