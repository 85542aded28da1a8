"""Angle for any torque history, from a saved posterior."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.model.parameter import Scale
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.reducer import ReducerModel
from backdrive_bayes.model.registry import members_named
from backdrive_bayes.results import read_group

DRAWS = 500
HARMONICS = 48


def predict_angles(posterior_nc: Path, time_s, torque_nm, *, rng, start: str = "unknown", draws: int = DRAWS) -> np.ndarray:
    """Whole curves of the angle [rad], shape (draws, samples), for a torque history of shape (samples,).

    Each curve has one parameter draw, one encoder offset, one past (``start`` "unknown": the prior's; "rest": none) and one
    smooth model error, so that points of a curve belong together. Raises BadInput on an unreadable posterior or path.
    """
    parameters = read_group(posterior_nc, "posterior")
    _require_converged(posterior_nc, parameters)
    scale = Scale(float(parameters.attrs["rated_torque_nm"]), float(parameters.attrs["angle_scale_rad"]))
    model = ReducerModel(members_named(parameters.attrs["modules"].split(",")), scale)
    lacking = [p.name for p in model.parameters if not p.per_record and p.name not in parameters]
    if lacking:
        raise BadInput(posterior_nc, f"the parameter {lacking[0]}", "none, in a fit of an earlier version: fit the unit again")
    chosen = rng.integers(parameters.sizes["chain"] * parameters.sizes["draw"], size=draws)
    values = {p.name: _values(p, parameters, chosen, scale, rng, start)[:, None] for p in model.parameters}
    path = TorquePath.from_samples(torque_nm, time_s)
    angle = np.concatenate([model.angle({k: v[a : a + 50] for k, v in values.items()}, path) for a in range(0, draws, 50)])
    return angle + _offsets(parameters, chosen, rng)[:, None] + _model_error(parameters.attrs, path, angle[0], draws, rng)


def _require_converged(path, parameters):
    if not parameters.attrs["converged"]:
        raise BadInput(path, "a converged posterior", "one whose sampling did not converge (fit it with a longer --budget)")


def _values(parameter, parameters, chosen, scale, rng, start):
    if not parameter.per_record:
        return parameters[parameter.name].values.ravel()[chosen]
    if start == "rest":
        return np.zeros(chosen.size)
    return parameter.scaled_prior(scale).from_normal(rng.standard_normal(chosen.size))


def _offsets(parameters, chosen, rng):
    """The offset of a record taken at random: another mounting of the same bench."""
    offsets = parameters["offset"].values.reshape(-1, parameters.sizes["record"])
    return offsets[chosen, rng.integers(offsets.shape[1], size=chosen.size)]


def _model_error(attributes, path, angle, draws, rng):
    """Prior draws of the discrepancy along the path, shape (draws, samples), smooth in distance travelled."""
    scale, length = float(attributes["discrepancy_scale_rad"]), float(attributes["discrepancy_length"])
    if scale == 0.0:
        return 0.0
    span_torque, span_angle = 2 * np.abs(path.torque_nm).max() + 1e-300, np.ptp(angle) + 1e-300
    travel = np.abs(np.diff(path.torque_nm)) / span_torque + np.abs(np.diff(angle)) / span_angle
    # One loop is a travel of four: there and back in torque and in angle.
    loops = np.concatenate([[0.0], np.cumsum(travel)]) / 4
    turns = max(1.0, loops[-1])
    order = np.arange(1, int(HARMONICS * turns) + 1) / turns
    weight = (1 + (2 * np.pi * order * length) ** 2) ** -float(attributes["discrepancy_roughness"])
    weight = scale * np.sqrt(weight / weight.sum()) * min(1.0, span_angle / (2 * float(attributes["angle_scale_rad"])))
    phase = 2 * np.pi * order * loops[:, None]
    out = np.empty((draws, loops.size))
    for a in range(0, draws, 50):
        n = len(out[a : a + 50])
        cosine, sine = rng.standard_normal((2, n, order.size))
        out[a : a + n] = (cosine * weight) @ np.cos(phase).T + (sine * weight) @ np.sin(phase).T
    return out
