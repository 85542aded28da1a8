"""posterior.nc: a posterior in ArviZ's groups, readable by old and new ArviZ alike and whole enough to be evaluated again."""

from __future__ import annotations

import json
import platform
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.parameters import posterior_parameters
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.posterior_read import ARRAYS, BLOCKS, LEGS
from backdrive_bayes.engine.predictive import block_offsets, replicates
from backdrive_bayes.results import POSTERIOR, SEAL, digest_of


@one_thread()
def write_posterior(posterior: Posterior, path: Path, about: dict | None = None) -> str:
    """Write the groups posterior, unconstrained_posterior (the weights), sample_stats, posterior_predictive, observed_data and
    constant_data; angles in rad, torques in N·m. ``about`` holds the fit's ``options``, ``findings`` on its data and whether it
    was ``forced``, kept as attributes. Returns the seal, a SHA-256 of everything in the file.
    """
    groups = posterior_groups(posterior, about or {})
    seal = digest_of(groups)
    for mode, (name, dataset) in zip("w" + "a" * (len(groups) - 1), groups.items(), strict=True):
        encoding = {v: {"zlib": True, "complevel": 1} for v in dataset.data_vars if dataset[v].dtype.kind == "f"}
        sealed = dataset.assign_attrs({SEAL: seal})
        sealed.to_netcdf(path, mode=mode, group=name, engine="h5netcdf", encoding=encoding)
    return seal


def as_saved(posterior: Posterior) -> Posterior:
    """The posterior with its weights rounded as the file holds them, so that saving it changes no result."""
    return replace(posterior, weights={n: w.astype(np.float32).astype(float) for n, w in posterior.weights.items()})


def posterior_groups(posterior: Posterior, about: dict) -> dict:
    """The groups as xarray datasets by name."""
    import xarray

    attributes = attributes_of(posterior, about)

    def dataset(variables):
        return xarray.Dataset(variables, attrs=attributes)

    parameters = {n: v.reshape(posterior.shape) for n, v in posterior_parameters(posterior).items()}
    scales = {f"log_scale_{n}": s for n, s in posterior.log_scale.items()}
    weights = {n: (("chain", "draw", f"{n}_weight"), w.astype(np.float32)) for n, w in posterior.weights.items()}
    return {
        "posterior": dataset({n: (("chain", "draw"), v) for n, v in (parameters | scales).items()}),
        "unconstrained_posterior": dataset(weights),
        "sample_stats": dataset({"lp": (("chain", "draw"), posterior.log_density)}),
        "posterior_predictive": dataset({"angle_rad": (("chain", "draw", "block"), replicates(posterior))}),
        "observed_data": dataset({"angle_rad": (("block",), _joined(b.angle_rad for b in posterior.records.blocks))}),
        "constant_data": dataset(_constant(posterior)),
    }


def software() -> str:
    """Versions of what computed."""
    packages = ("backdrive-bayes", "numpy", "scipy", "emcee", "arviz-stats")
    return "; ".join(f"{p} {version(p)}" for p in packages) + f"; Python {platform.python_version()}"


def attributes_of(posterior: Posterior, about: dict) -> dict:
    """What every group says of the fit; nested values as JSON."""
    context, records, found = posterior.context, posterior.records, posterior.convergence
    return {
        "schema": POSTERIOR,
        "unit": posterior.unit_name,
        "data_sha256": ",".join(posterior.data_hashes),
        "modules": ",".join(posterior.reducer.modules),
        "effects": ",".join(e.name for e in posterior.effects),
        "hypothesis": json.dumps(posterior.hypothesis),
        "rated_torque_nm": float(posterior.rated_torque_nm),
        "torque_scale_nm": float(context.torque_scale_nm),
        "angle_scale_rad": float(context.angle_scale_rad),
        "angle_noise": float(context.angle_noise),
        "torque_noise": float(context.torque_noise),
        "distortion": json.dumps({n: float(v) for n, v in vars(posterior.distortion).items()}),
        "jitter": json.dumps([float(j) for j in posterior.jitter]),
        "records": json.dumps(list(records.names)),
        "noise": json.dumps([{k: float(v) for k, v in vars(n).items()} for n in records.noise]),
        "convergence_names": json.dumps(list(found.names)),
        "evaluations": int(found.evaluations),
        "converged": int(posterior.converged),
        "doubts": json.dumps(list(posterior.doubts)),
        "acceptance": float(posterior.acceptance),
        "seed": int(posterior.seed),
        "options": json.dumps(about.get("options", {}), sort_keys=True),
        "findings": json.dumps(about.get("findings", []), sort_keys=True),
        "forced": int(about.get("forced", False)),
        "inference_library": "emcee",
        "inference_library_version": version("emcee"),
        "creation_library": "backdrive_bayes",
        "versions": software(),
    }


def _constant(posterior: Posterior) -> dict:
    """Everything else that evaluation, diagnosis and figures need: the blocks of all records one after the other."""
    records, found = posterior.records, posterior.convergence
    blocks = records.blocks
    out = {name: (("block",), _joined(np.broadcast_to(getattr(b, name), b.count.shape) for b in blocks)) for name in BLOCKS}
    out["block_record"] = (("block",), _number(b.count.size for b in blocks))
    out["turning_nm"] = (("turn",), _joined(b.turning_nm for b in blocks))
    out["turning_record"] = (("turn",), _number(b.turning_nm.size for b in blocks))
    out["path_s"], out["path_nm"] = ((("path",), _joined(getattr(b, n) for b in blocks)) for n in ("path_s", "path_nm"))
    out["path_record"] = (("path",), _number(b.path_s.size for b in blocks))
    out["direction"] = (("leg_number",), _joined(b.direction for b in blocks))
    out[LEGS] = (("leg_number",), _number(b.direction.size for b in blocks))
    out |= {name: (("block",), _joined(getattr(posterior, name))) for name in ARRAYS}
    out["offset_rad"] = (("record",), np.array(block_offsets(posterior)))
    out["loading_rate_nm_per_s"] = (("record",), records.rate_nm_per_s)
    out["amplitude_nm"] = (("record",), records.amplitude_nm)
    out["relative_rate"] = (("record",), posterior.context.rate)
    out["duration_s"] = (("record",), posterior.context.duration_s)
    out["relative_amplitude"] = (("record",), posterior.context.amplitude)
    out["knots"] = (("knot",), posterior.reducer.knots)
    out["flank_ratios"] = (("flank",), posterior.reducer.ratios)
    return out | {name: (("diagnosed",), getattr(found, name)) for name in ("rhat", "bulk_ess", "tail_ess")}


def _joined(parts):
    return np.concatenate([np.asarray(p) for p in parts])


def _number(sizes):
    return np.concatenate([np.full(n, i) for i, n in enumerate(sizes)])
