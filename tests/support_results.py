"""A small result folder written by hand: what `fit` saves, without a fit."""

import json

import numpy as np
import xarray
from support.told import told

from backdrive_bayes.results import SEAL, digest_of

GROUP_ATTRIBUTES = {
    "schema": "backdrive-bayes/posterior/7",
    "unit": "u",
    "data_sha256": "0123456789abcdef" * 4,
    "modules": "geometric,elastic,friction",
    "rated_torque_nm": 0.1,
    "seed": 7,
    "inference_library": "emcee",
    "inference_library_version": "3.1.6",
    "versions": "backdrive-bayes 0.1.0; numpy 2.0; Python 3.11",
}
PARAMETERS = {"clearance_rad": ("rad", 0.039), "drag_torque_Nm": ("N·m", 0.004), "load_friction_ratio": ("1", 0.05)}
RATES = (0.01, 0.05, 0.1)
CHAINS, DRAWS, BLOCKS = 3, 60, 30


def write_result(folder, records=2, shared=PARAMETERS, **changes):
    """Write indicators.json and posterior.nc of some records into ``folder`` and return the JSON object.

    ``shared`` maps names of shared parameters to unit and value.
    """
    folder.mkdir(parents=True, exist_ok=True)
    digest = _write_posterior(folder / "posterior.nc", records, shared, changes.get("unit", "u"))
    result = told(indicators(records, shared) | {"posterior_sha256": digest} | changes)
    (folder / "indicators.json").write_text(json.dumps(result), encoding="utf-8")
    return result


def interval(value, spread=0.01):
    return {"median": value, "lo": value * (1 - spread), "hi": value * (1 + spread)}


def branch(torque, direction):
    return 0.02 * np.tanh(300 * (torque - direction * 0.003)) + 0.15 * torque


def indicators(records, shared=PARAMETERS):
    parameters = {
        k: interval(v) | {"unit": u, "definition": f"what {k} means", "null": 0.0, "prior_interval": interval(2 * v, 0.9)}
        for k, (u, v) in shared.items()
    }
    return {
        "schema": "backdrive-bayes/indicators/1",
        "unit": "u",
        "k": 0.03,
        "level": 0.9,
        "model": {"modules": ["geometric", "elastic", "friction"], "effects": []},
        "convergence": {
            "converged": True,
            "max_rhat": 1.004,
            "min_bulk_ess": 1500.0,
            "min_tail_ess": 1200.0,
            "evaluations": 4000,
            "worst": "friction",
            "advice": "",
            "contradictions": [],
        },
        "jitter": {"torque_Nm": 2e-5, "length_Nm": 1e-3},
        "data_sha256": ["0123456789abcdef" * 4],
        "unit_sha256": "",
        "seed": 7,
        "versions": "backdrive-bayes 0.1.0; numpy 2.0; Python 3.11",
        "parameters": parameters,
        "records": [_record(r) for r in range(records)],
    }


def _record(r):
    torque = np.linspace(-0.1, 0.1, 41)
    rising, falling = branch(torque, 1), branch(torque, -1)
    positive = np.linspace(0, 0.1, 21)
    energy = 0.03 * np.exp(-(((positive - 0.004) / 0.004) ** 2)) + 1e-3
    return {
        "file": f"record-{r}",
        "loading_rate_Nm_per_s": RATES[r % 3] * 10 ** (r // 3),
        "amplitude_Nm": 0.1,
        "indicators": {
            "lost_motion_rad": interval(0.0095),
            "zero_torque_width_rad": interval(0.0292, 0.006),
            "peak_angle_rad": interval(0.03254 + 1e-4 * r, 0.001),
            "loop_area_J": interval(3.63e-4, 0.005),
            "absorbed_J": interval(1.55e-3, 0.005),
            "dissipation_ratio": interval(0.2343, 0.006),
        },
        "loop": {
            "torque_Nm": torque.tolist(),
            "rising_rad": _band(rising),
            "falling_rad": _band(falling),
        },
        "mechanism": {
            "S_g_J": interval(2.7e-4),
            "S_f_J": interval(9e-5),
            "S_g_over_S": interval(0.74),
            "S_f_over_S": interval(0.25),
        },
        "modules": {
            "geometric": _curves(rising - 0.15 * torque, falling - 0.15 * torque),
            "elastic": _curves(0.15 * torque, 0.15 * torque),
        },
        "torque_energy": {
            "torque_Nm": positive.tolist(),
            "median_J_per_Nm": energy.tolist(),
            "lo": (0.95 * energy).tolist(),
            "hi": (1.05 * energy).tolist(),
            "tau1_Nm": interval(0.002),
            "tau2_Nm": interval(0.008),
        },
        "by_amplitude": {
            "amplitude_Nm": [0.025, 0.05, 0.075, 0.1],
            "loop_area_J": [interval(1e-4 * (i + 1)) for i in range(4)],
            "dissipation_ratio": [interval(0.5 / (i + 1)) for i in range(4)],
            **{
                f"{f}_{q}": interval(v)
                for q, v in (("S_J", 2e-4), ("u", 0.3))
                for f in ("max", "min", "mean")
            },
        },
        "back_drive": {"load_Nm": 0.1, "theta_L_rad": interval(0.047), "W_L_J": interval(7.7e-4)},
        "noise": {"white_rad": 3e-5, "correlated_rad": 7e-5, "correlation_time_s": 0.026, "torque_Nm": 1e-4},
    }


def _band(curve):
    return {"median": curve.tolist(), "lo": (curve - 1e-4).tolist(), "hi": (curve + 1e-4).tolist()}


def _curves(rising, falling):
    return {"rising_rad": rising.tolist(), "falling_rad": falling.tolist()}


def _write_posterior(path, records, parameters, unit):
    rng = np.random.default_rng(1)
    legs = (("first", 0.0, 0.1), ("down", 0.1, -0.1), ("up", -0.1, 0.1))
    torque = np.concatenate([np.linspace(a, b, BLOCKS) for _, a, b in legs])
    sign = np.repeat([1, -1, 1], BLOCKS)
    angle = np.where(sign > 0, branch(torque, 1), branch(torque, -1)) + 0.5
    n = torque.size
    noise = 2e-4 * rng.standard_normal((CHAINS, 20, records * n))
    scales = {f"log_scale_{k}": (("chain", "draw"), rng.standard_normal((CHAINS, DRAWS))) for k in ("elastic", "friction")}
    scales["log_scale_sensor_lag"] = (("chain", "draw"), np.full((CHAINS, DRAWS), -7.6))
    shared = scales | {
        k: (("chain", "draw"), v * np.exp(0.05 * rng.standard_normal((CHAINS, DRAWS))))
        for k, (_, v) in parameters.items()
    }
    groups = {
        "posterior": shared,
        "unconstrained_posterior": {},
        "sample_stats": {"lp": (("chain", "draw"), rng.standard_normal((CHAINS, DRAWS)))},
        "posterior_predictive": {"angle_rad": (("chain", "draw", "block"), np.tile(angle, records) + noise)},
        "observed_data": {
            "angle_rad": (("block",), np.tile(angle, records) + 2e-4 * rng.standard_normal(records * n))
        },
        "constant_data": {
            "torque_nm": (("block",), np.tile(torque, records)),
            "leg": (("block",), np.tile(np.repeat([0, 1, 2], BLOCKS), records)),
            "block_record": (("block",), np.repeat(np.arange(records), n)),
            "turning_nm": (("turn",), np.tile([0.0, 0.1, -0.1, 0.1], records)),
            "offset_rad": (("record",), np.full(records, 0.5)),
            "turning_record": (("turn",), np.repeat(np.arange(records), 4)),
        },
    }
    attributes = GROUP_ATTRIBUTES | {"unit": unit}
    data = {name: xarray.Dataset(variables, attrs=attributes) for name, variables in groups.items()}
    digest = digest_of(data)
    for i, (name, dataset) in enumerate(data.items()):
        dataset.assign_attrs({SEAL: digest}).to_netcdf(path, mode="a" if i else "w", group=name, engine="h5netcdf")
    return digest
