"""Reading posterior.nc back: the same posterior, or one line on what is wrong with the file."""

from __future__ import annotations

import json
from pathlib import Path

from backdrive_bayes.engine.diagnostics import Convergence
from backdrive_bayes.engine.posterior import Posterior, RecordFacts
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.effect import Context, Distortion
from backdrive_bayes.mechanics.reducer import ReducerClass
from backdrive_bayes.mechanics.registry import UNKNOWN, library_terms
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.reduction import Blocks
from backdrive_bayes.results import read_groups

BLOCKS = ("torque_nm", "torque_variance_nm2", "begin_s", "end_s", "count", "leg", "bend_rad", "torque_trend_nm2")
ARRAYS = ("predicted_rad", "residual", "noise_sd_rad")
LEGS = "leg_record"


def read_posterior(path: Path | str) -> Posterior:
    """The posterior that ``write_posterior`` saved; BadInput where the file is none, lacks something or was changed."""
    path = Path(path)
    groups = read_groups(path)
    try:
        return _rebuilt(groups)
    except (KeyError, ValueError, TypeError, AttributeError, IndexError) as error:
        detail = str(error).strip("'\"")[:60]
        raise BadInput(path, "a posterior of this version with all its parts", f"{type(error).__name__} {detail}") from None


def _rebuilt(groups) -> Posterior:
    constant, about = groups["constant_data"], groups["constant_data"].attrs
    posterior, weights = groups["posterior"], groups["unconstrained_posterior"]
    own = constant["block_record"].values
    records = _records(constant, groups["observed_data"], json.loads(about["records"]), json.loads(about["noise"]))
    hypothesis = json.loads(about["hypothesis"])
    prefix = "log_scale_"
    return Posterior(
        unit_name=str(about["unit"]),
        data_hashes=tuple(filter(None, str(about["data_sha256"]).split(","))),
        rated_torque_nm=float(about["rated_torque_nm"]),
        reducer=ReducerClass(
            constant["knots"].values,
            tuple(str(about["modules"]).split(",")),
            constant["flank_ratios"].values,
        ),
        distortion=Distortion(**json.loads(about["distortion"])),
        effects=_effects(str(about["effects"])),
        context=_context(constant, about),
        records=records,
        weights={str(n): w.values.astype(float) for n, w in weights.items()},
        log_scale={str(n).removeprefix(prefix): s.values for n, s in posterior.items() if str(n).startswith(prefix)},
        log_density=groups["sample_stats"]["lp"].values,
        **{name: tuple(constant[name].values[own == r] for r in range(records.count)) for name in ARRAYS},
        convergence=Convergence(
            tuple(json.loads(about["convergence_names"])),
            constant["rhat"].values,
            constant["bulk_ess"].values,
            constant["tail_ess"].values,
            int(about["evaluations"]),
        ),
        acceptance=float(about["acceptance"]),
        seed=int(about["seed"]),
        hypothesis=None if hypothesis is None else tuple(hypothesis),
        jitter=tuple(json.loads(about["jitter"])),
        doubts=tuple(json.loads(about["doubts"])),
    )


def _effects(names):
    known = {term.name: term for term in (*library_terms(), UNKNOWN)}
    return tuple(known[name] for name in filter(None, names.split(",")))


def _context(constant, about) -> Context:
    return Context(
        float(about["torque_scale_nm"]),
        float(about["angle_scale_rad"]),
        constant["relative_rate"].values,
        constant["duration_s"].values,
        float(about["angle_noise"]),
        float(about["torque_noise"]),
        constant["relative_amplitude"].values,
    )


def _records(constant, observed, names, noise) -> RecordFacts:
    blocks = []
    for r, name in enumerate(names):
        own = constant["block_record"].values == r
        arrays = {n: constant[n].values[own] for n in BLOCKS} | {"angle_rad": observed["angle_rad"].values[own]}
        turning = constant["turning_nm"].values[constant["turning_record"].values == r]
        direction = constant["direction"].values[constant[LEGS].values == r]
        arrays |= {n: constant[n].values[constant["path_record"].values == r] for n in ("path_s", "path_nm")}
        blocks.append(Blocks(name=name, turning_nm=turning, direction=direction, **arrays))
    rate, amplitude = (constant[n].values for n in ("loading_rate_nm_per_s", "amplitude_nm"))
    return RecordFacts(tuple(names), rate, amplitude, tuple(blocks), tuple(NoiseEstimate(**n) for n in noise))
