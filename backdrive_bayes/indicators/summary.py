"""From a posterior to indicators.json: intervals of every indicator of every record."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.intervals import LEVEL, interval, over_positions
from backdrive_bayes.indicators.loop import (
    Loops,
    discrepancy_loops,
    model_loops,
    module_loops,
    record_amplitude_nm,
    torque_grid,
)
from backdrive_bayes.indicators.other_loops import OtherLoops, some_draws
from backdrive_bayes.inference.discrepancy import Discrepancy
from backdrive_bayes.inference.fit import Posterior
from backdrive_bayes.inference.problem import Problem
from backdrive_bayes.results import INDICATORS

POSITIONS = 10
POSITION_DRAWS = 500


def core_indicators(loops: Loops, lost_motion_torque_nm: float) -> dict[str, np.ndarray]:
    """The six indicators of the contract by name, each of shape (draws,)."""
    return {
        "lost_motion_rad": ind.lost_motion_rad(loops, lost_motion_torque_nm),
        "zero_torque_width_rad": ind.zero_torque_width_rad(loops),
        "peak_angle_rad": ind.peak_angle_rad(loops),
        "loop_area_J": ind.loop_area_j(loops),
        "absorbed_J": ind.absorbed_j(loops),
        "dissipation_ratio": ind.dissipation_ratio(loops),
    }


def monitored(k: float):
    """The quantities that must converge beside the parameters, as ``fit`` wants them."""

    def quantities(problem: Problem, discrepancy: Discrepancy, z, weights):
        named = {}
        for r, data in enumerate(problem.records):
            loops = reducer_loops(problem, discrepancy, z, weights, r, k)
            for name, value in core_indicators(loops, k * _rated(problem)).items():
                named[f"{name} of {data.blocks.name}"] = value
        return named

    return quantities


def reducer_loops(problem, discrepancy, z, weights, record, k) -> Loops:
    """The reducer's own settled loops: model plus discrepancy."""
    torque = torque_grid(record_amplitude_nm(problem, record), (k * _rated(problem),))
    loops = model_loops(problem, z, record, torque)
    if not discrepancy.present:
        return loops
    return loops + discrepancy_loops(problem, discrepancy, weights, record, torque)


def _rated(problem):
    return problem.model.scale.torque_nm


def indicators_json(posterior: Posterior, k: float, level: float = LEVEL) -> dict:
    """The contract's indicators object (least-squares comparison left to the caller)."""
    problem = posterior.problem
    return {
        "schema": INDICATORS,
        "unit": posterior.unit.name,
        "k": k,
        "level": level,
        "model": {"modules": list(problem.model.names), "effects": []},
        "convergence": posterior.convergence.to_json(),
        "model_error": _model_error_json(posterior),
        "parameters": _parameters_json(posterior, level),
        "records": [_record_json(posterior, r, k, level) for r in range(len(problem.records))],
    }


def _model_error_json(posterior):
    d = posterior.discrepancy
    return {
        "scale_rad": d.scale_rad,
        "length_loops": d.length,
        "log_evidence_gain": d.gain,
        "note": "Indicators are of model plus discrepancy; model_error_share: part of an interval's squared width due to it.",
    }


def _parameters_json(posterior, level):
    physical = posterior.problem.physical(posterior.z)
    out = {}
    for i, (label, c) in enumerate(zip(posterior.problem.labels, posterior.problem.coordinates, strict=True)):
        prior = c.parameter.scaled_prior(posterior.problem.model.scale)
        out[label] = interval(physical[:, i], level) | {"unit": c.parameter.unit, "prior": prior.describe()}
    return out


def _record_json(posterior, record, k, level):
    problem, z, weights = posterior.problem, posterior.z, posterior.weights
    data = problem.records[record]
    torque = torque_grid(record_amplitude_nm(problem, record), (k * _rated(problem), _rated(problem)))
    bare = model_loops(problem, z, record, torque)
    full = bare
    if posterior.discrepancy.present:
        full = bare + discrepancy_loops(problem, posterior.discrepancy, weights, record, torque)
    energy_torque, energy = ind.torque_energy(full)
    tau1, tau2 = ind.hump_torques_nm(energy_torque, energy)
    lo, median, hi = np.quantile(energy, [0.5 - level / 2, 0.5, 0.5 + level / 2], axis=0)
    return {
        "file": data.blocks.name,
        "loading_rate_Nm_per_s": loading_rate_nm_per_s(data),
        "amplitude_Nm": record_amplitude_nm(problem, record),
        "indicators": _core_json(bare, full, k * _rated(problem), level),
        "loop": _loop_json(full, level),
        **_mechanism_json(posterior, record, torque, full, level),
        "torque_energy": {
            "torque_Nm": energy_torque.tolist(),
            "median_J_per_Nm": median.tolist(),
            "lo": lo.tolist(),
            "hi": hi.tolist(),
            "tau1_Nm": interval(tau1, level),
            "tau2_Nm": interval(tau2, level),
        },
        "by_amplitude": _by_amplitude_json(posterior, record, level),
        "windowed": _windowed_json(full, level),
        "back_drive": _back_drive_json(full, _rated(problem), level),
        "noise": _noise_json(data.noise),
    }


def loading_rate_nm_per_s(data) -> float:
    """Median |dτ/dt| of a reduced record [N·m/s]."""
    same = np.diff(data.blocks.leg) == 0
    return float(np.median(np.abs(np.diff(data.blocks.torque_nm) / np.diff(data.blocks.mid_s))[same]))


def _core_json(bare, full, lost_motion_torque, level):
    with_error, without = core_indicators(full, lost_motion_torque), core_indicators(bare, lost_motion_torque)
    out = {}
    for name, values in with_error.items():
        entry = interval(values, level)
        if entry is not None:
            spread = np.var(values)
            entry["model_error_share"] = float(np.clip(1 - np.var(without[name]) / spread, 0, 1)) if spread > 0 else 0.0
        out[name] = entry
    return out


def _loop_json(full, level):
    # Where on its scale the encoder reads the loop is no property of the reducer: bands are those of the loop's shape.
    middle = 0.5 * (full.rising.mean(axis=1) + full.falling.mean(axis=1))
    shift, bands = np.median(middle) - middle[:, None], {}
    for branch in ("rising", "falling"):
        lo, median, hi = np.quantile(getattr(full, branch) + shift, [0.5 - level / 2, 0.5, 0.5 + level / 2], axis=0)
        bands[f"{branch}_rad"] = {"median": median.tolist(), "lo": lo.tolist(), "hi": hi.tolist()}
    return {"torque_Nm": full.torque_nm.tolist(), **bands}


def _mechanism_json(posterior, record, torque, full, level):
    """S_g and S_f, the areas that the geometric and friction modules enclose (the rest is the discrepancy's), and their loops."""
    modules = module_loops(posterior.problem, posterior.z, record, torque)
    area, split, curves = ind.loop_area_j(full), {}, {}
    for name, loops in modules.items():
        curves[name] = {
            "rising_rad": np.median(loops.rising, axis=0).tolist(),
            "falling_rad": np.median(loops.falling, axis=0).tolist(),
        }
    for name, key in (("geometric", "S_g"), ("friction", "S_f")):
        if name in modules:
            own = ind.loop_area_j(modules[name])
            split[f"{key}_J"], split[f"{key}_over_S"] = interval(own, level), interval(own / area, level)
    return {"mechanism": split, "modules": curves}


def _by_amplitude_json(posterior, record, level):
    """S(t) and u(t) of loops of amplitude t, model predictions with the discrepancy's prior spread, and their extremes."""
    other = OtherLoops(posterior, record, some_draws(posterior, POSITION_DRAWS))
    amplitudes = _positions(other.amplitude_nm)
    loops = [other.of(t) for t in amplitudes]
    values = (np.stack([f(x) for x in loops]) for f in (ind.loop_area_j, ind.dissipation_ratio))
    return {"amplitude_Nm": amplitudes.tolist(), **over_positions(*values, level)}


def _windowed_json(full, level):
    """The same of windows |τ| ≤ t cut out of the measured loop; this u(t) may exceed 1, for a window is no closed loop."""
    torque = _positions(full.torque_nm[-1])
    windows = [full.within(t) for t in torque]
    values = (np.stack([f(x) for x in windows]) for f in (ind.loop_area_j, ind.dissipation_ratio))
    return {"torque_Nm": torque.tolist(), **over_positions(*values, level)}


def _positions(amplitude):
    return amplitude * np.arange(1, POSITIONS + 1) / POSITIONS


def _back_drive_json(full, rated, level):
    load = min(rated, float(full.torque_nm[-1]))
    angle, energy = ind.back_drive(full, load)
    return {"load_Nm": load, "theta_L_rad": interval(angle, level), "W_L_J": interval(energy, level)}


def _noise_json(noise):
    return {
        "white_rad": noise.white_rad,
        "correlated_rad": noise.correlated_rad,
        "correlation_time_s": noise.correlation_time_s,
        "torque_Nm": noise.torque_nm,
    }
