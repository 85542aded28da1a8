"""Geometric error, stiffness and friction as numbers: functionals of the operator that is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.mechanics.cells import Cells, join
from backdrive_bayes.mechanics.friction import FRICTION
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.reducer import ReducerClass

CROSSED_BELOW = 0.3
"""Clearance is what is crossed below this share of the largest torque; steps above it are stiffness that falls or slips."""
NEAR_ZERO, NEAR_RATED = 0.15, 0.85
"""Compliances are secants of the settled loading branch up to the first, and from the second up to T_r."""
SMALL_CENTRE = 0.28
"""Friction torque is that of plays as far as they are read out below this share of the largest torque."""
LEAST_SUM = 0.1
"""Share of the sum of magnitudes below which weights nearly cancel and weighted means mean nothing."""
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Operator:
    """Draws of clean reducers: ``weights`` (draws, cells) by part in shares of the angle scale.

    ``end`` is the rated torque, or the largest one tested where that is less, as a share of the latter.
    """

    reducer: ReducerClass
    weights: dict[str, np.ndarray]
    torque_scale_nm: float
    angle_scale_rad: float
    end: float

    @classmethod
    def of(cls, posterior: Posterior, independent: dict[str, np.ndarray] | None = None) -> Operator:
        """Those of a posterior, or others of the same class with ``independent`` weights (draws, weights) by part."""
        given, context = independent or posterior.flat, posterior.context
        weights = {p.name: p.weights(given[p.name].T).T for p in posterior.reducer.parts}
        end = min(1.0, posterior.rated_torque_nm / context.torque_scale_nm)
        return cls(posterior.reducer, weights, context.torque_scale_nm, context.angle_scale_rad, end)

    def angles(self, part: str, chosen) -> np.ndarray:
        """Angles that the chosen cells of a part contribute, (draws, chosen)."""
        cells = self.reducer.part(part).cells
        return self.weights[part][:, chosen] * (cells.width / cells.norm)[chosen]

    def loading_slope(self, parts: tuple[str, ...], low: float, high: float) -> np.ndarray:
        """Secant of the settled loading branch of some parts between two shares of the largest torque [rad/(N·m)], (draws,)."""
        history = through(np.arange(5.0), np.array([0.0, 1.0, -1.0, low, high]), 1.0)
        found = np.zeros(1)
        for part in (p for p in self.reducer.parts if p.name in parts):
            ends = part.cells.ends(history)
            found = found + self.weights[part.name] @ (ends[-1] - ends[-2])
        return found / (high - low) * self.angle_scale_rad / self.torque_scale_nm


@dataclass(frozen=True)
class Parameter:
    """A parameter of the user: ``of`` maps an :class:`Operator` to draws (draws,); at ``null`` its module vanishes."""

    name: str
    symbol: str
    module: str
    unit: str
    null: float
    definition: str
    of: Callable[[Operator], np.ndarray]


def _low(op: Operator, part: str) -> np.ndarray:
    return op.reducer.part(part).cells.up < CROSSED_BELOW


def _clearance(op: Operator) -> np.ndarray:
    # A free-play cell is passed on either side of zero torque, a clearance cell once.
    steps = op.weights["clearance"][:, _low(op, "clearance")].sum(axis=1)
    steps = steps + 2.0 * op.weights["free_play"][:, _low(op, "free_play")].sum(axis=1)
    return steps * op.angle_scale_rad


def _crossing(op: Operator) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of the crossing torque over the clearance [N·m], (draws,) each."""
    low = _low(op, "clearance")
    cells = op.reducer.part("clearance").cells
    middle, width = (cells.up + 0.5 * cells.width)[low], cells.width[low]
    mean, spread = _moments(op.angles("clearance", low), middle, width**2 / 12.0)
    return mean * op.torque_scale_nm, spread * op.torque_scale_nm


def _hardening(op: Operator) -> np.ndarray:
    zero, rated = _compliance_zero(op), _compliance_rated(op)
    return 1.0 - rated / np.where(np.abs(zero) > TINY, zero, TINY)


def _compliance_zero(op: Operator) -> np.ndarray:
    return op.loading_slope(("compliance", "elastic", *FRICTION), 0.0, NEAR_ZERO * op.end)


def _compliance_rated(op: Operator) -> np.ndarray:
    # So far up every step is compliance: clearance is crossed below.
    return op.loading_slope(("compliance", "elastic", *FRICTION, "clearance", "free_play"), NEAR_RATED * op.end, op.end)


def _plays(op: Operator) -> tuple[Cells, np.ndarray]:
    """Cells of all friction, and the angle that each contributes, (draws, cells)."""
    own = [p for p in op.reducer.parts if p.name in FRICTION]
    angle = np.concatenate([op.angles(p.name, slice(None)) for p in own], axis=1)
    return join(*(p.cells for p in own)), angle


def _near(op: Operator) -> tuple[np.ndarray, np.ndarray]:
    """Thresholds of plays that are read out at small loads, (cells,), and the angle that each contributes there."""
    cells, angle = _plays(op)
    share = np.clip((SMALL_CENTRE - cells.centre) / _read_out(cells) + 0.5, 0.0, 1.0)
    return cells.threshold[share > 0], (angle * share)[:, share > 0]


def _read_out(cells: Cells) -> np.ndarray:
    """Range of the load over which each play is read out, (cells,)."""
    return 0.5 * (cells.width + cells.fall)


def _friction_torque(op: Operator) -> np.ndarray:
    threshold, angle = _near(op)
    return _moments(angle, threshold)[0] * op.torque_scale_nm


def _friction_spread(op: Operator) -> np.ndarray:
    threshold, angle = _near(op)
    return _moments(angle, np.log(threshold))[1]


def _load_ratio(op: Operator) -> np.ndarray:
    cells, angle = _plays(op)
    centre, threshold = (v - _moments(angle, v)[0][:, None] for v in (cells.centre, cells.threshold))
    square = angle * (centre**2 + _read_out(cells) ** 2 / 12.0)
    return np.sum(angle * centre * threshold, axis=1) / _safe_sum(square)


def _moments(angle, value, within=0.0):
    """Mean and standard deviation of ``value`` (cells,) weighted by ``angle`` (draws, cells), (draws,) each.

    ``within`` (cells,) is the variance inside the cells. Signed weights make the moments those of what the data see; results stay
    within the range of the values where the weights nearly cancel.
    """
    total = _safe_sum(angle)
    mean = np.clip(angle @ value / total, value.min(), value.max())
    square = np.sum(angle * ((value - mean[:, None]) ** 2 + within), axis=1) / total
    return mean, np.sqrt(np.clip(square, 0.0, np.ptp(value) ** 2))


def _safe_sum(angle):
    """Sum over the cells, no less than LEAST_SUM of the sum of magnitudes."""
    return np.maximum(angle.sum(axis=1), LEAST_SUM * np.abs(angle).sum(axis=1) + TINY)


PARAMETERS = (
    Parameter(
        "clearance_rad", "j", "geometric", "rad", 0.0,
        "full free angle between the flanks, as far as it is crossed below 0.3 of the largest torque",
        _clearance,
    ),
    Parameter(
        "drag_torque_Nm", "τ_d", "geometric", "N·m", 0.0,
        "mean torque at which the clearance is crossed, weighted by the angle crossed",
        lambda op: _crossing(op)[0],
    ),
    Parameter(
        "engagement_width_Nm", "σ_d", "geometric", "N·m", 0.0,
        "standard deviation of the crossing torque, weighted alike",
        lambda op: _crossing(op)[1],
    ),
    Parameter(
        "compliance_zero_rad_per_Nm", "c_0", "elastic", "rad/(N·m)", 0.0,
        "secant of the settled loading branch from zero to 0.15 T_r, without clearance and free play",
        _compliance_zero,
    ),
    Parameter(
        "compliance_rated_rad_per_Nm", "c_r", "elastic", "rad/(N·m)", 0.0,
        "secant of the settled loading branch from 0.85 T_r to T_r",
        _compliance_rated,
    ),
    Parameter(
        "hardening", "h", "elastic", "1", 0.0,
        "1 less the ratio of the compliance at T_r to that at zero",
        _hardening,
    ),
    Parameter(
        "friction_torque_Nm", "τ_f", "friction", "N·m", 0.0,
        "mean play threshold at small loads, weighted by the angle of each play",
        _friction_torque,
    ),
    Parameter(
        "load_friction_ratio", "μ", "friction", "1", 0.0,
        "slope of the mean play threshold over the load at which it acts, weighted alike",
        _load_ratio,
    ),
    Parameter(
        "friction_spread", "s_f", "friction", "1", 0.0,
        "standard deviation of the log thresholds at small loads, weighted alike",
        _friction_spread,
    ),
)  # fmt: skip
"""Every parameter with the module that it belongs to."""


def parameters_of(operator: Operator) -> dict[str, np.ndarray]:
    """Draws (draws,) of every parameter whose module the class has, by name."""
    return {p.name: p.of(operator) for p in PARAMETERS if p.module in operator.reducer.modules}


def posterior_parameters(posterior: Posterior) -> dict[str, np.ndarray]:
    """Draws (draws,) of the parameters by name, chains one after the other."""
    return parameters_of(Operator.of(posterior))


def implied_prior(posterior: Posterior, draws: int = 500, seed: int = 0) -> dict[str, np.ndarray]:
    """The same for ``draws`` reducers from the prior of the class with this posterior's knots."""
    return parameters_of(Operator.of(posterior, prior_weights(posterior, draws, np.random.default_rng([seed, 7]))[1]))


def prior_weights(posterior: Posterior, draws: int, rng) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Log scales (draws,) and weights (draws, weights) of every part of the class from its prior, with a posterior's knots."""
    log_scale, weights = {}, {}
    for part in posterior.reducer.parts:
        mean, sd = part.log_scale
        log_scale[part.name] = mean + sd * rng.standard_normal(draws)
        size = posterior.flat[part.name].shape[1]
        weights[part.name] = np.exp(log_scale[part.name])[:, None] * rng.standard_normal((draws, size))
    return log_scale, weights
