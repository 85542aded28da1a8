"""Effects inside the class: properties of the operator, each with a practical size.

Evidence against the class cannot find what the class holds. A second clearance is a separate step of the settled loading branch;
slip of the output interface is angle gained near full load that a branch without slip does not gain. The probability of each is
that of its size among those that are there, not among those that every reducer has.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, log_ndtr

from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import find_scales
from backdrive_bayes.gap.averaged import with_columns
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.gap.probabilities import CALIBRATION, probabilities
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.registry import UNKNOWN

DRAWS = 120
FALLEN = 0.1
"""The first clearance is crossed where the slope has fallen to this share of its largest."""
APART = 2.0
"""A second clearance is crossed at so many times the torque of the first at least."""
LOWEST, HIGHEST = 0.1, 0.7
"""Torques, in shares of the largest, between which a second clearance is looked for."""
STEP = 0.006
"""Standard deviation of steps that every reducer has (teeth that engage one after the other), in shares of the angle scale."""
LARGE_STEP = 0.04
"""That of a second clearance or of slip where there is one."""
ABOVE = 0.12
"""A step stands out where the slope exceeds the neighbourhood's by this share."""
MIDDLE, TIP = (0.35, 0.65), 0.7
"""Torques from which the compliance is extrapolated, and from which on slip is looked for."""
SURE = 0.97
"""No property is more certain than this: thresholds are practical, not physical."""


@dataclass(frozen=True)
class Property:
    """Probability that the operator has a property, its size [rad] and torque [N·m] with draws' quantiles."""

    name: str
    probability: float
    size_rad: np.ndarray
    torque_nm: float


@dataclass(frozen=True, eq=False)
class LoadingBranch:
    """Slopes dθ/dz (draws, points) of the settled loading branch at positive torques ``z`` (points,), over steps ``dz``."""

    z: np.ndarray
    dz: np.ndarray
    slope: np.ndarray


def loading_branch(linear: Linear, rng, draws: int = DRAWS) -> LoadingBranch:
    """Draws of the settled loading branch of the class at the mode's scales."""
    solution = linear.solution
    noise = np.sqrt(solution.variance) * rng.standard_normal((solution.root.shape[1], draws))
    weights = linear.design.split(solution.mean[:, None] + solution.root @ noise)
    half = np.unique(np.r_[0.0, np.geomspace(1e-4, 1.0, 160), np.linspace(0.0, 1.0, 81)])
    path = np.r_[half, half[::-1][1:], -half[1:], -half[::-1][1:], half[1:]]
    columns = linear.reducer.ends(through(np.arange(path.size, dtype=float), path, 1.0))
    angle = sum(columns[n] @ weights[n] for n in columns)[-half.size :].T
    step = np.diff(half)
    return LoadingBranch(0.5 * (half[1:] + half[:-1]), step, np.diff(angle, axis=1) / step)


def second_clearance(branch: LoadingBranch) -> tuple[np.ndarray, float]:
    """Angle of the largest separate step beyond the first clearance (draws,), and its torque (0 where there is none)."""
    z, base = branch.z, _neighbourhood(branch)
    mean, level = branch.slope.mean(axis=0), base.mean(axis=0)
    peak = int(np.argmax(np.where(z < 0.35, mean, -np.inf)))
    fallen = np.flatnonzero(mean[peak:] < FALLEN * mean[peak])
    crossed = z[peak + fallen[0]] if fallen.size else HIGHEST
    stands = (mean - level > ABOVE * np.maximum(level, 0.05)) & (z > max(APART * z[peak], crossed, LOWEST)) & (z < HIGHEST)
    edges = np.flatnonzero(np.diff(np.r_[False, stands, False]))
    best, place = np.zeros(branch.slope.shape[0]), 0.0
    for a, b in edges.reshape(-1, 2):
        angle = ((branch.slope - base) * branch.dz)[:, a:b].sum(axis=1)
        if np.median(angle) > np.median(best):
            best, place = angle, float(z[(a + b - 1) // 2])
    return best, place


def slip_angle(branch: LoadingBranch) -> np.ndarray:
    """Angle gained near full load beyond what the compliance of the middle gives, (draws,)."""
    middle = (branch.z > MIDDLE[0]) & (branch.z < MIDDLE[1])
    usual = np.median(branch.slope[:, middle], axis=1)
    top = branch.z > TIP
    return (branch.slope[:, top] - usual[:, None]) @ branch.dz[top]


def find_properties(weighed: Weighed, rng) -> tuple[Property, ...]:
    """Second clearance and interface slip of the operator that is left where the likeliest effects act."""
    linear = _beside_effects(weighed)
    branch, scale, uneven = loading_branch(linear, rng), linear.reduced.angle_scale_rad, _unevenness(linear)
    step, at = second_clearance(branch)
    slip = slip_angle(branch)
    return (
        Property("second_backlash", present(step, uneven), step * scale, at * linear.reduced.torque_scale_nm),
        Property("interface_slip", present(slip, uneven), slip * scale, TIP * linear.reduced.torque_scale_nm),
    )


def present(values, uneven: float = STEP) -> float:
    """Probability that a size known as ``values`` (draws,) is one of those that are there, not of those that all reducers have.

    Sizes of the first kind are half-normal with LARGE_STEP, of the second normal with ``uneven`` about zero.
    """
    mean, variance = float(np.mean(values)), float(np.var(values)) + uneven**2
    usual = -0.5 * np.log(variance) - 0.5 * mean**2 / variance
    whole = variance + LARGE_STEP**2
    large = np.log(2.0) - 0.5 * np.log(whole) - 0.5 * mean**2 / whole + log_ndtr(mean * LARGE_STEP / np.sqrt(variance * whole))
    return float(np.clip(expit(large - usual + CALIBRATION.single), 1.0 - SURE, SURE))


def _unevenness(linear: Linear) -> float:
    """Standard deviation of apparent steps: those of every reducer, and what a wave or leaps of the angle leave as such."""
    waves = linear.design.predict(linear.weights, [n for n in ("wave", UNKNOWN.name) if n in linear.design.names] or ["none"])
    height = max(float(np.std(w)) for w in waves)
    return float(np.hypot(STEP, 2.0 * height))


def _beside_effects(weighed: Weighed) -> Linear:
    """The linear model solved with the effects that are likeliest, all others at trace level."""
    joint = probabilities(weighed.log_factor, weighed.left, {})
    best = max((h for h in joint if h in weighed.log_factor), key=lambda h: joint[h])
    linear = with_columns(weighed, best)
    scales = linear.design.scales(levels(linear, best))
    start = np.where(scales.free, [linear.log_scale[n] for n in linear.design.names], scales.mean)
    return replace(linear, solution=find_scales(linear.data, scales, start)[1])


def _neighbourhood(branch):
    """Slope around each point without its own neighbours: mean of the medians on both sides, (draws, points)."""
    z, found = branch.z, np.empty_like(branch.slope)
    for i, at in enumerate(z):
        below = (z > at / 1.8) & (z < at / 1.15)
        above = (z > at * 1.15) & (z < at * 1.8)
        sides = [np.median(branch.slope[:, s], axis=1) for s in (below, above) if s.sum() >= 2]
        found[:, i] = np.mean(sides, axis=0) if sides else branch.slope[:, i]
    return np.maximum(found, 0.0)
