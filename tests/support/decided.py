"""Evidence made by hand: draws of the indicators of small known units, in memory and as result folders."""

import json

import numpy as np
import xarray
from support_results import GROUP_ATTRIBUTES, indicators

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.indicators.draws import CORE, POSITIONS, RESPONSES, UNITS

TYPICAL = {
    "lost_motion_rad": 0.0095,
    "zero_torque_width_rad": 0.029,
    "peak_angle_rad": 0.0325,
    "loop_area_J": 3.7e-4,
    "absorbed_J": 1.55e-3,
    "dissipation_ratio": 0.238,
    "tau1_Nm": 0.002,
    "tau2_Nm": 0.008,
    "hump_torque_Nm": 0.004,
    "S_g_J": 2.7e-4,
    "S_f_J": 0.9e-4,
    "S_g_over_S": 0.73,
    "S_f_over_S": 0.26,
    "elastic_share": 0.76,
    "theta_L_rad": 0.047,
    "W_L_J": 7.7e-4,
}
LOOPS = ((0.01, 0.1), (0.05, 0.1), (0.1, 0.1))
CHAINS, DRAWS, KEPT = 4, 500, 400


def evidence(name="u", loops=LOOPS, spread=0.01, seed=0, converged=True, diagnosis=None, k=0.03, effects=(), small=1.0, **means):
    """Evidence with normal draws about ``means`` (typical values by default); a list of means is one a record.

    ``small`` scales what loops of smaller amplitude are predicted as; S and absorbed energy grow with the square of it.
    """
    about = _about(name, loops, converged, k, effects)
    return Evidence(about, draws(loops, spread, seed, k, small, means), _parameters(seed), diagnosis, name)


def draws(loops=LOOPS, spread=0.01, seed=0, k=0.03, small=1.0, means=None):
    """The group ``indicators`` as a posterior file holds it."""
    rng, n = np.random.default_rng(seed), len(loops)
    rates, amplitudes = (np.array(x) for x in zip(*loops, strict=True))
    kept = np.linspace(0, CHAINS * DRAWS - 1, KEPT).astype(int)
    fraction = np.arange(1, POSITIONS + 1) / POSITIONS
    variables = {}
    for name, typical in (TYPICAL | (means or {})).items():
        values = np.broadcast_to(typical, n) * (1 + spread * rng.standard_normal((CHAINS, DRAWS, n)))
        variables[name] = (("chain", "draw", "record"), values, {"unit": UNITS[name]})
        if name in CORE:
            grown = fraction if name == "peak_angle_rad" else fraction**2 if name.endswith("_J") else np.ones(POSITIONS)
            curve = values.reshape(-1, n)[kept][:, :, None] * (small * grown + (1 - small) * (fraction == 1))
            variables[f"{name}_by_amplitude"] = (("kept", "record", "position"), curve)
    torque = np.linspace(-1, 1, 81) ** 3 * amplitudes[:, None]
    width = 0.03 * np.exp(-((np.abs(torque) / 0.004 - 1) ** 2))
    names = ["clearance", "compliance", "friction_torque"]
    variables |= {
        "position_Nm": (("record", "position"), amplitudes[:, None] * fraction),
        "width_torque_Nm": (("record", "point"), torque),
        "width_rad": (("kept", "record", "point"), width * (1 + spread * rng.standard_normal((KEPT, n, 1)))),
        "model_error_share": (("indicator", "record"), np.full((len(CORE), n), 0.2)),
        "sensitivity": (("sensed", "response", "parameter"), np.full((20, len(RESPONSES), len(names)), 0.5)),
        "parameter": (("parameter",), names),
    }
    coords = {"kept": kept, "amplitude_Nm": ("record", amplitudes), "loading_rate_Nm_per_s": ("record", rates)}
    coords |= {"indicator": list(CORE), "response": list(RESPONSES)}
    return xarray.Dataset(variables, coords, GROUP_ATTRIBUTES | {"k": k, "rated_torque_nm": 0.1})


def write_evidence(folder, name="u", loops=LOOPS, diagnosis=None, **options):
    """The same as a result folder of a fit; returns the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    made = evidence(name, loops, diagnosis=diagnosis, **options)
    (folder / "indicators.json").write_text(json.dumps(made.about), encoding="utf-8")
    shared = {n: (("chain", "draw"), v.reshape(CHAINS, DRAWS)) for n, v in made.parameters.items()}
    groups = {"posterior": xarray.Dataset(shared, attrs=GROUP_ATTRIBUTES), "indicators": made.draws}
    for mode, (group, data) in zip("wa", groups.items(), strict=True):
        data.to_netcdf(folder / "posterior.nc", mode=mode, group=group, engine="h5netcdf")
    if diagnosis:
        (folder / "diagnosis.json").write_text(json.dumps(diagnosis), encoding="utf-8")
    return folder


def diagnosis(answer=(), **which):
    """A diagnosis object with those probabilities by effect."""
    found = [{"effect": n, "probability": p} for n, p in which.items()]
    return {"schema": "backdrive-bayes/diagnosis/1", "which": found, "answer": {"effects": list(answer)},
            "gap": {"probability": 0.9}, "next_test": {"do": "Measure at another rate."}}  # fmt: skip


def _about(name, loops, converged, k, effects):
    about = indicators(len(loops)) | {"unit": name, "k": k}
    about["model"] = {"modules": ["geometric", "elastic", "friction"], "effects": list(effects)}
    advice = "" if converged else "not converged within the budget: give it more time"
    about["convergence"] |= {"converged": converged, "advice": advice}
    for record, (rate, amplitude) in zip(about["records"], loops, strict=True):
        record |= {"loading_rate_Nm_per_s": rate, "amplitude_Nm": amplitude}
        quality = {"r_squared": 0.999, "rms_rad": 3e-4, "rms_high_load_over_rest": 2.0}
        branches = {"ascending": quality, "descending": quality}
        record["least_squares"] = {"branches": branches, "indicators": {"loop_area_J": 3.0e-4}}
    return about


def _parameters(seed):
    rng = np.random.default_rng(seed + 1)
    return {"clearance": 0.03 * np.exp(0.02 * rng.standard_normal(CHAINS * DRAWS))}
