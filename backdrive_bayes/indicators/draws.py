"""Draws of the indicators, saved with the posterior: what decisions are made from, without sampling again."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.loop import (
    discrepancy_loops,
    model_loops,
    module_loops,
    record_amplitude_nm,
    torque_grid,
)
from backdrive_bayes.indicators.other_loops import OtherLoops
from backdrive_bayes.indicators.summary import core_indicators, loading_rate_nm_per_s
from backdrive_bayes.inference.fit import Posterior

KEPT = 500
"""Draws kept of everything that depends on an amplitude or a torque."""
POSITIONS = 20
WIDTH_POINTS = 81
SENSITIVITY_DRAWS = 100
STEP = 0.02
"""Change of a parameter's logarithm by which sensitivities are taken."""
UNITS = {
    "lost_motion_rad": "rad",
    "zero_torque_width_rad": "rad",
    "peak_angle_rad": "rad",
    "loop_area_J": "J",
    "absorbed_J": "J",
    "dissipation_ratio": "1",
    "tau1_Nm": "N·m",
    "tau2_Nm": "N·m",
    "hump_torque_Nm": "N·m",
    "S_g_J": "J",
    "S_f_J": "J",
    "S_g_over_S": "1",
    "S_f_over_S": "1",
    "elastic_share": "1",
    "theta_L_rad": "rad",
    "W_L_J": "J",
}
"""Every indicator on which a limit, a comparison or a claim may rest, with its unit."""
CORE = ("lost_motion_rad", "zero_torque_width_rad", "peak_angle_rad", "loop_area_J", "absorbed_J", "dissipation_ratio")
RESPONSES = ("theta_L_rad", "W_L_J", "loop_area_J", "S_g_J", "S_f_J")


def indicator_draws(posterior: Posterior, k: float):
    """The group ``indicators`` of a posterior file as an xarray dataset of float32.

    Indicators have dimensions (chain, draw, record). For ``kept`` draws, whose numbers in the flat list of draws are that
    coordinate, there are the core indicators of loops of smaller amplitude, ``…_by_amplitude`` (kept, record, position), the
    loop's ``width_rad`` (kept, record, point), and log sensitivities (sensed, response, parameter). Undefined is NaN.
    """
    import xarray

    problem, rated = posterior.problem, posterior.problem.model.scale.torque_nm
    shape, records = posterior.ensembles.z.shape[:2], range(len(posterior.problem.records))
    kept = np.linspace(0, len(posterior.z) - 1, min(KEPT, len(posterior.z))).astype(int)
    own = [_of_record(posterior, r, k * rated, rated, kept) for r in records]
    small = [_smaller(posterior, r, k * rated, kept) for r in records]
    variables = {}
    for name in own[0][0]:
        values = np.stack([o[0].get(name) for o in own], axis=-1).reshape(*shape, -1).astype(np.float32)
        variables[name] = (("chain", "draw", "record"), values, {"unit": UNITS[name]})
    for name in CORE:
        values = np.stack([s[name] for s in small], axis=1).astype(np.float32)
        variables[f"{name}_by_amplitude"] = (("kept", "record", "position"), values, {"unit": UNITS[name]})
    amplitude = np.array([record_amplitude_nm(problem, r) for r in records])
    variables |= {
        "position_Nm": (("record", "position"), amplitude[:, None] * np.arange(1, POSITIONS + 1) / POSITIONS),
        "width_torque_Nm": (("record", "point"), np.stack([o[1] for o in own])),
        "width_rad": (("kept", "record", "point"), np.stack([o[2] for o in own], axis=1).astype(np.float32), {"unit": "rad"}),
        "model_error_share": (("indicator", "record"), np.stack([o[3] for o in own], axis=-1)),
        **_sensitivities(posterior, int(np.argmax(amplitude)), rated),
    }
    rates = np.array([loading_rate_nm_per_s(d) for d in problem.records])
    coords = {
        "record": [d.blocks.name for d in problem.records],
        "kept": kept,
        "indicator": list(CORE),
        "response": list(RESPONSES),
        "amplitude_Nm": ("record", amplitude),
        "loading_rate_Nm_per_s": ("record", rates),
    }
    return xarray.Dataset(variables, coords=coords, attrs={"k": k, "rated_torque_nm": rated})


def _of_record(posterior, record, lost_motion_torque, rated, kept):
    """Indicators of the measured loop, its width for kept draws, and the model error's share in the core ones."""
    problem, z, weights = posterior.problem, posterior.z, posterior.weights
    torque = torque_grid(record_amplitude_nm(problem, record), (lost_motion_torque, rated))
    bare = model_loops(problem, z, record, torque)
    full = bare
    if posterior.discrepancy.present:
        full = bare + discrepancy_loops(problem, posterior.discrepancy, weights, record, torque)
    named = core_indicators(full, lost_motion_torque)
    without = core_indicators(bare, lost_motion_torque)
    share = [_share(named[name], without[name]) for name in CORE]
    named |= _humps(full) | _mechanism(posterior, record, torque, full)
    named["theta_L_rad"], named["W_L_J"] = ind.back_drive(full, min(rated, float(torque[-1])))
    points = torque[-1] * np.linspace(-1, 1, WIDTH_POINTS) ** 3
    width = np.stack([np.interp(points, torque, w) for w in full.width[kept]])
    return named, points, width, share


def _share(values, without):
    spread = np.var(values)
    return float(np.clip(1 - np.var(without) / spread, 0, 1)) if spread > 0 else 0.0


def _humps(full):
    torque, curve = ind.torque_energy(full)
    tau1, tau2 = ind.hump_torques_nm(torque, curve)
    return {"tau1_Nm": tau1, "tau2_Nm": tau2, "hump_torque_Nm": torque[np.argmax(curve, axis=1)]}


def _mechanism(posterior, record, torque, full):
    """Areas of geometric error and friction, and the share of the absorbed energy that is given back."""
    modules = module_loops(posterior.problem, posterior.z, record, torque)
    area = ind.loop_area_j(full)
    nothing = np.full(area.shape, np.nan)
    split = {f"S_{m[0]}_J": ind.loop_area_j(modules[m]) if m in modules else nothing for m in ("geometric", "friction")}
    split |= {f"S_{x}_over_S": split[f"S_{x}_J"] / area for x in "gf"}
    # What a settled loop absorbs and does not dissipate was stored elastically and is given back.
    split["elastic_share"] = 1 - area / ind.absorbed_j(full)
    return split


def _smaller(posterior, record, lost_motion_torque, kept):
    """Core indicators (kept, positions) of loops of smaller amplitude: the model's, with the model error scaled down."""
    other = OtherLoops(posterior, record, kept)
    found: dict[str, list] = {name: [] for name in CORE}
    for t in other.amplitude_nm * np.arange(1, POSITIONS + 1) / POSITIONS:
        for name, values in core_indicators(other.of(t, (lost_motion_torque,)), lost_motion_torque).items():
            found[name].append(values)
    return {name: np.stack(values, axis=1) for name, values in found.items()}


def _sensitivities(posterior, record, rated):
    """d ln(response) / d ln(parameter) of the model's loop, for the shared parameters; the largest loop's."""
    problem = posterior.problem
    shared = [i for i, c in enumerate(problem.coordinates) if c.record is None]
    sensed = np.linspace(0, len(posterior.z) - 1, min(SENSITIVITY_DRAWS, len(posterior.z))).astype(int)
    torque = torque_grid(record_amplitude_nm(problem, record), (rated,))
    physical = problem.physical(posterior.z[sensed])
    logs = np.stack([_log_responses(problem, physical, i, record, torque, rated) for i in shared], axis=-1)
    return {
        "sensitivity": (("sensed", "response", "parameter"), logs.astype(np.float32), {"unit": "1"}),
        "sensed": (("sensed",), sensed),
        "parameter": (("parameter",), [problem.coordinates[i].parameter.name for i in shared]),
    }


def _log_responses(problem, physical, i, record, torque, rated):
    """Central difference of the log responses by the log of one parameter, shape (draws, responses)."""
    ends = []
    for sign in (1, -1):
        moved = physical.copy()
        moved[:, i] *= np.exp(0.5 * sign * STEP)
        at = _Moved(problem, moved)
        loops = model_loops(at, moved, record, torque)
        modules = module_loops(at, moved, record, torque)
        theta, energy = ind.back_drive(loops, min(rated, float(torque[-1])))
        areas = [ind.loop_area_j(modules[m]) if m in modules else np.full(len(moved), np.nan) for m in ("geometric", "friction")]
        ends.append(np.stack([theta, energy, ind.loop_area_j(loops), *areas], axis=1))
    with np.errstate(divide="ignore", invalid="ignore"):
        return (np.log(ends[0]) - np.log(ends[1])) / STEP


class _Moved:
    """A problem whose coordinates are already physical values."""

    def __init__(self, problem, physical):
        self.problem, self.model = problem, problem.model

    def values(self, physical, record):
        """Parameters of one record by name, as ``Problem.values`` gives them."""
        return self.problem._named(physical, record)

    def __getattr__(self, name):
        return getattr(self.problem, name)
