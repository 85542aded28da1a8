"""Draws around the mode of a hypothesis, its parameters and its indicators: what the diagnosis reports of it.

The draws are those of the model made linear at its mode (a Laplace approximation); a sampled posterior of the chosen model is
written apart.
"""

from __future__ import annotations

import numpy as np

from backdrive_bayes.gap.hypotheses import Fitted
from backdrive_bayes.gap.setting import Setting, Whitening
from backdrive_bayes.indicators.loop import model_loops, torque_grid
from backdrive_bayes.indicators.summary import core_indicators, interval
from backdrive_bayes.inference.discrepancy import amplitude_nm

DRAWS = 400
SHOWN = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")
Z_BOUND = 6.0


def laplace_draws(fitted: Fitted, whitening: Whitening, rng) -> np.ndarray:
    """Coordinates drawn around the mode, shape (draws, dimension)."""
    jacobian = whitening.matrix @ fitted.jacobian
    covariance = np.linalg.inv(np.eye(fitted.z.size) + jacobian.T @ jacobian)
    z = fitted.z + rng.standard_normal((DRAWS, fitted.z.size)) @ np.linalg.cholesky(covariance).T
    return np.clip(z, -Z_BOUND, Z_BOUND)


def parameter_table(fitted: Fitted, z, level: float) -> dict[str, dict]:
    """Interval and unit of every parameter by label."""
    physical = fitted.problem.physical(z)
    return {
        label: interval(physical[:, i], level) | {"unit": c.parameter.unit}
        for i, (label, c) in enumerate(zip(fitted.problem.labels, fitted.problem.coordinates, strict=True))
    }


def effect_parameters(fitted: Fitted, table: dict[str, dict], effect: str) -> dict[str, dict]:
    """The part of a parameter table that belongs to one effect."""
    names = {p.name for m in fitted.problem.model.members if m.name == effect for p in m.parameters}
    return {label: row for label, row in table.items() if label.split("[")[0] in names}


def shifts(before: Fitted, z_before, after: Fitted, z_after, level: float) -> list[dict]:
    """How each shared parameter of the baseline moves when the effect is added, in its own standard deviations."""
    old, new = parameter_table(before, z_before, level), parameter_table(after, z_after, level)
    rows = []
    for i, (label, c) in enumerate(zip(before.problem.labels, before.problem.coordinates, strict=True)):
        if c.record is not None:
            continue
        j = after.problem.labels.index(label)
        sd = max(float(np.std(z_before[:, i])), 1e-12)
        unit = old[label]["unit"]
        rows.append({
            "parameter": label, "unit": unit,
            "before": {k: v for k, v in old[label].items() if k != "unit"},
            "after": {k: v for k, v in new[label].items() if k != "unit"},
            "shift_sd": float((after.z[j] - before.z[i]) / sd),
        })  # fmt: skip
    return rows


def widest(setting: Setting) -> int:
    """Number of the first record of the largest amplitude."""
    return max(range(len(setting.problem.records)), key=lambda r: amplitude_nm(setting.problem, r))


def indicator_change(setting: Setting, before: Fitted, z_before, after: Fitted, z_after, k: float, level: float) -> dict:
    """δ, S and u of :func:`widest` before and after."""
    record = widest(setting)
    out = {name: {} for name in SHOWN}
    for key, fitted, z in (("before", before, z_before), ("after", after, z_after)):
        lost_motion_at = k * setting.unit.rated_torque_nm
        loops = model_loops(fitted.problem, z, record, torque_grid(amplitude_nm(setting.problem, record), (lost_motion_at,)))
        values = core_indicators(loops, lost_motion_at)
        for name in SHOWN:
            out[name][key] = interval(values[name], level)
    return out
