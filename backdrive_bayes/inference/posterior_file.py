"""posterior.nc: a posterior in ArviZ's groups, readable by old and new ArviZ alike."""

from __future__ import annotations

import platform
from importlib.metadata import version
from pathlib import Path

import numpy as np

from backdrive_bayes.inference.fit import Posterior
from backdrive_bayes.results import POSTERIOR

PREDICTIVE_PER_ENSEMBLE = 50


def write_posterior(posterior: Posterior, path: Path, more: dict | None = None) -> None:
    """Write the groups posterior, unconstrained_posterior, sample_stats, log_likelihood, posterior_predictive,
    observed_data and constant_data; angles in rad, torques in N·m. ``more`` are further datasets by group name.
    """
    extra = {name: dataset.assign_attrs(attributes_of(posterior) | dataset.attrs) for name, dataset in (more or {}).items()}
    groups = posterior_groups(posterior) | extra
    mode = "w"
    for name, dataset in groups.items():
        encoding = {v: {"zlib": True, "complevel": 1} for v in dataset.data_vars if dataset[v].dtype.kind == "f"}
        dataset.to_netcdf(path, mode=mode, group=name, engine="h5netcdf", encoding=encoding)
        mode = "a"


def posterior_groups(posterior: Posterior) -> dict:
    """The groups as xarray datasets by name."""
    import xarray

    problem = posterior.problem
    attributes = attributes_of(posterior)
    records = [d.blocks.name for d in problem.records]
    block_record = np.concatenate([np.full(d.blocks.count.size, r) for r, d in enumerate(problem.records)])
    coords = {"record": records, "coordinate": list(problem.labels)}

    def dataset(variables, **more):
        used = {d for dims, _ in variables.values() for d in dims}
        keep = {k: v for k, v in (coords | more).items() if k in used}
        return xarray.Dataset(variables, coords=keep, attrs=attributes)

    rng = np.random.default_rng([posterior.seed, 2])
    angle, offsets = _block_angles(posterior, rng)
    return {
        "posterior": dataset(_parameters(posterior) | {"offset": (("chain", "draw", "record"), offsets)}),
        "unconstrained_posterior": dataset({"z": (("chain", "draw", "coordinate"), posterior.ensembles.z)}),
        "sample_stats": dataset({"lp": (("chain", "draw"), posterior.ensembles.log_posterior)}),
        "log_likelihood": dataset({"angle_rad": (("chain", "draw", "block"), _log_likelihood(posterior))}),
        "posterior_predictive": dataset({"angle_rad": (("chain", "draw", "block"), _replicates(posterior, angle, offsets, rng))}),
        "observed_data": dataset({"angle_rad": (("block",), _blocks(problem, "angle_rad"))}),
        "constant_data": dataset(
            {name: (("block",), _blocks(problem, name)) for name in ("torque_nm", "begin_s", "end_s", "count", "leg")}
            | {"block_record": (("block",), block_record)}
            | _discrepancy_variables(posterior)
        ),
    }


def attributes_of(posterior: Posterior) -> dict:
    """What every group says of the fit: schema, unit, data hash, model, seed, convergence and versions."""
    problem, discrepancy = posterior.problem, posterior.discrepancy
    packages = ("backdrive-bayes", "numpy", "scipy", "emcee", "arviz")
    return {
        "schema": POSTERIOR,
        "unit": posterior.unit.name,
        "data_sha256": posterior.unit.data_hash,
        "modules": ",".join(problem.model.names),
        "rated_torque_nm": problem.model.scale.torque_nm,
        "angle_scale_rad": problem.model.scale.angle_rad,
        "seed": posterior.seed,
        "converged": int(posterior.converged),
        "acceptance": posterior.ensembles.acceptance,
        "steps": posterior.ensembles.steps,
        "discrepancy_scale_rad": discrepancy.scale_rad,
        "discrepancy_length": discrepancy.length,
        "discrepancy_roughness": discrepancy.roughness,
        "inference_library": "emcee",
        "inference_library_version": version("emcee"),
        "creation_library": "backdrive_bayes",
        "versions": "; ".join(f"{p} {version(p)}" for p in packages) + f"; Python {platform.python_version()}",
    }


def _parameters(posterior):
    """Shared parameters with dimensions (chain, draw), those of a record with (chain, draw, record)."""
    problem = posterior.problem
    physical = problem.physical(posterior.ensembles.z)
    named: dict = {}
    for i, c in enumerate(problem.coordinates):
        if c.record is None:
            named[c.parameter.name] = (("chain", "draw"), physical[..., i], {"unit": c.parameter.unit})
        else:
            dims, values, attrs = named.setdefault(
                c.parameter.name,
                (("chain", "draw", "record"), np.empty((*physical.shape[:2], len(problem.records))), {"unit": c.parameter.unit}),
            )
            values[..., c.record] = physical[..., i]
    return {k: v[:2] for k, v in named.items()}


def _blocks(problem, name):
    return np.concatenate([getattr(d.blocks, name) for d in problem.records])


def _thin(posterior):
    draws = posterior.ensembles.z.shape[1]
    return np.linspace(0, draws - 1, min(PREDICTIVE_PER_ENSEMBLE, draws)).astype(int)


def _block_angles(posterior, rng):
    """Model plus discrepancy at the blocks for thinned draws (chain, draws, blocks), and offset draws of all draws."""
    problem, pick = posterior.problem, _thin(posterior)
    z, weights = posterior.ensembles.z[:, pick], posterior.discrepancy_weights[:, pick]
    angles = []
    for r, data in enumerate(problem.records):
        angle = problem.model.angle(problem.values(z, r), data.path)
        if posterior.discrepancy.present:
            angle = angle + weights @ posterior.discrepancy.basis_on(problem, r, data.path, first_leg=True).T
        angles.append(angle)
    chunks = [problem.offsets_rad(part) for part in np.array_split(posterior.z, max(1, posterior.z.shape[0] // 500))]
    offsets = np.concatenate(chunks)
    if posterior.discrepancy.present:
        # The offset is what is left of the data after model and discrepancy.
        for r, data in enumerate(problem.records):
            basis = posterior.discrepancy.basis_on(problem, r, data.path, first_leg=True)
            offsets[:, r] -= posterior.weights @ (data.offset_weight @ basis)
    offsets = offsets.reshape(*posterior.ensembles.z.shape[:2], -1)
    sd = np.array([d.offset_sd_rad for d in problem.records])
    return np.concatenate(angles, axis=-1), offsets + sd * rng.standard_normal(offsets.shape)


def _replicates(posterior, angle, offsets, rng):
    """Replicated block means: angle + offset + noise with the block covariance, float32 (chain, draws, blocks)."""
    problem, pick, out, column = posterior.problem, _thin(posterior), [], 0
    for r, data in enumerate(problem.records):
        n = data.blocks.count.size
        lower = np.linalg.cholesky(data.covariance)
        noise = rng.standard_normal((*angle.shape[:2], n)) @ lower.T
        out.append(angle[..., column : column + n] + offsets[:, pick, r, None] + noise)
        column += n
    return np.concatenate(out, axis=-1).astype(np.float32)


def _log_likelihood(posterior):
    """Log density of each whitened block residual less the mean discrepancy given the draw, float32 (chain, draw, block)."""
    problem = posterior.problem
    discrepancy = posterior.discrepancy
    out = []
    for part in np.array_split(posterior.z, max(1, posterior.z.shape[0] // 500)):
        white = np.concatenate(problem.residuals(part), axis=-1)
        if discrepancy.present:
            white = white - (white @ discrepancy.absorber) @ discrepancy.absorber.T
        out.append(-0.5 * white**2 - 0.5 * np.log(2 * np.pi))
    return np.concatenate(out).reshape(*posterior.ensembles.z.shape[:2], -1).astype(np.float32)


def _discrepancy_variables(posterior):
    d = posterior.discrepancy
    return {
        "mode_z": (("coordinate",), d.optimum.z),
        "turning_nm": (("turn",), np.concatenate([x.blocks.turning_nm for x in posterior.problem.records])),
        "turning_record": (
            ("turn",),
            np.concatenate([np.full(x.blocks.turning_nm.size, r) for r, x in enumerate(posterior.problem.records)]),
        ),
    }
