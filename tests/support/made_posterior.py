"""Posteriors made by hand: draws about a known reducer, with blocks as a short record would have them."""

import copy
from functools import lru_cache
from hashlib import sha256

import numpy as np

from backdrive_bayes.bench.known_truth import KnownReducer, physical_reducer
from backdrive_bayes.engine.diagnostics import Convergence
from backdrive_bayes.engine.posterior import Posterior, RecordFacts
from backdrive_bayes.mechanics.effect import Context, Distortion
from backdrive_bayes.mechanics.friction import loops as usual_loops
from backdrive_bayes.mechanics.registry import LIBRARY
from backdrive_bayes.records.noise import NoiseEstimate
from backdrive_bayes.records.reduction import Blocks
from support.bench import path_of

LOOPS = ((0.01, 0.1), (0.05, 0.1), (0.1, 0.1))
CHAINS, DRAWS = 4, 60
NOISE = NoiseEstimate(3e-5, 7e-5, 0.03, 1e-4, 1e-6, 3e-6, 3e-3, 1e-6, 200.0)
OFFSET = 0.5


def known(**options) -> KnownReducer:
    """A known reducer whose weights do not scatter."""
    return physical_reducer(np.random.default_rng(0), **({"scatter": 0.0} | options))


def made_posterior(truth=None, loops=LOOPS, spread=0.01, seed=0, name="u", shape=(CHAINS, DRAWS), lag_s=0.0) -> Posterior:
    """Draws whose whole angle scatters by ``spread`` about a known reducer, with an angle channel late by ``lag_s``."""
    truth = truth or known()
    rng = np.random.default_rng([seed, 11])
    factor = 1 + spread * rng.standard_normal((*shape, 1))
    weights = {p.name: factor * _independent(p, truth.weights[p.name]) for p in truth.reducer.parts}
    effects = (*LIBRARY["torque_offset"], *LIBRARY["sensor_lag"])
    weights |= {"torque_offset": np.zeros((*shape, 1)), "sensor_lag": np.full((*shape, 1), lag_s)}
    rate, amplitude = (np.array(x, float) for x in zip(*loops, strict=True))
    blocks = tuple(made_blocks(truth, f"record-{i}", r, a, rng) for i, (r, a) in enumerate(loops))
    context = Context(
        truth.torque_scale_nm, truth.angle_scale_rad, rate / truth.torque_scale_nm,
        np.array([b.end_s[-1] - b.begin_s[0] for b in blocks]), 0.01, 1e-3, amplitude / truth.torque_scale_nm,
    )  # fmt: skip
    return Posterior(
        unit_name=name,
        data_hashes=(sha256(name.encode()).hexdigest(),),
        rated_torque_nm=truth.torque_scale_nm,
        reducer=truth.reducer,
        distortion=Distortion(),
        effects=effects,
        context=context,
        records=RecordFacts(tuple(b.name for b in blocks), rate, amplitude, blocks, (NOISE,) * len(blocks)),
        weights=weights,
        log_scale={n: rng.standard_normal(shape) for n in weights},
        log_density=rng.standard_normal(shape),
        predicted_rad=tuple(b.angle_rad - OFFSET for b in blocks),
        residual=tuple(rng.standard_normal(b.count.size) for b in blocks),
        noise_sd_rad=tuple(np.full(b.count.size, 8e-5) for b in blocks),
        convergence=Convergence(tuple(weights), *np.array([[1.001], [900.0], [900.0]]) * np.ones((3, len(weights))), 4000),
        acceptance=0.6,
        seed=seed,
        hypothesis=(),
        jitter=(2e-5, 1e-3),
    )


def made_blocks(truth, name, rate, amplitude, rng, per_leg=30) -> Blocks:
    """Blocks of a record 0 → +T → −T → +T, read with some noise."""
    turning = amplitude * np.array([0.0, 1.0, -1.0, 1.0])
    edges = [np.linspace(a, b, per_leg + 1) for a, b in zip(turning[:-1], turning[1:], strict=True)]
    torque = np.concatenate([0.5 * (e[1:] + e[:-1]) for e in edges])
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.concatenate([np.diff(e) for e in edges])))]) / rate
    angle = truth.angle_rad(0.5 * (travel[1:] + travel[:-1]), torque) + OFFSET + 5e-5 * rng.standard_normal(torque.size)
    count = np.full(torque.size, 20)
    small = np.full(torque.size, 1e-12)
    leg, direction = np.repeat([0, 1, 2], per_leg), np.array([1, -1, 1])
    path = path_of(travel[:-1], travel[1:], leg, torque, turning, 1e-12)
    return Blocks(name, torque, angle, small, travel[:-1], travel[1:], count, leg, turning, direction, 0 * torque, **path)


def _independent(part, weights):
    """Independent weights of a part that give the loops of the weights of its cells."""
    if part.mixing is None:
        return weights
    columns = part.cells.ends(usual_loops())
    return np.linalg.lstsq(columns @ part.mixing, columns @ weights, rcond=1e-10)[0]


@lru_cache(maxsize=32)
def _made_fit(name, loops, seed, size):
    from backdrive_bayes.commands.results import FitOptions, stamped
    from backdrive_bayes.engine.posterior_file import as_saved
    from backdrive_bayes.indicators.draws import IndicatorDraws
    from backdrive_bayes.indicators.summary import indicators_json

    truth = known()
    truth = KnownReducer({n: size * w for n, w in truth.weights.items()})
    posterior = as_saved(made_posterior(truth, loops, seed=seed, name=name))
    about = indicators_json(IndicatorDraws(posterior, 0.03), 0.9)
    about |= {"findings": [], "forced": False}
    origin = {"unit": name, "data_sha256": list(posterior.data_hashes), "unit_sha256": ""}
    return posterior, stamped(about, origin, seed, FitOptions().to_json())


def made_fit(name="u", loops=LOOPS, seed=0, size=1.0):
    """A made posterior and its indicators object, as ``fit_unit`` gives them; ``size`` scales all angles."""
    posterior, about = _made_fit(name, loops, seed, size)
    about = copy.deepcopy(about)
    quality = {"r_squared": 0.999, "rms_rad": 3e-4, "rms_high_load_over_rest": 2.0}
    for record in about["records"]:
        record["least_squares"] = {"branches": {"ascending": quality, "descending": quality}, "indicators": {"loop_area_J": 3e-4}}
    about["identity"], about["notes"] = {}, []
    return posterior, about
