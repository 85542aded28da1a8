"""Effects inside the class: properties of the operator, each with a practical threshold.

Evidence against the class cannot find what the class holds. A second clearance is a separate step of the settled loading branch;
slip of the output interface is angle gained near full load that a branch without slip does not gain. The probability of each is
that of the drawn operators beyond the threshold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from backdrive_bayes.engine.linearise import Linear
from backdrive_bayes.mechanics.history import through

DRAWS = 120
APART = 2.5
"""A second clearance is crossed at so many times the torque of the first at least."""
LOWEST, HIGHEST = 0.1, 0.7
"""Torques, in shares of the largest, between which a second clearance is looked for."""
STEP = 0.012
"""Least angle of a second clearance, in shares of the angle scale."""
ABOVE = 0.12
"""A step stands out where the slope exceeds the neighbourhood's by this share."""
MIDDLE, TIP = (0.35, 0.65), 0.7
"""Torques from which the compliance is extrapolated, and from which on slip is looked for."""
SLIP = 0.012
"""Least angle of slip, in shares of the angle scale."""
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
    first = z[np.argmax(np.where(z < 0.35, mean, -np.inf))]
    stands = (mean - level > ABOVE * np.maximum(level, 0.05)) & (z > max(APART * first, LOWEST)) & (z < HIGHEST)
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


def find_properties(linear: Linear, rng) -> tuple[Property, ...]:
    """Second clearance and interface slip."""
    branch, scale = loading_branch(linear, rng), linear.reduced.angle_scale_rad
    step, at = second_clearance(branch)
    slip = slip_angle(branch)
    return (
        Property("second_backlash", beyond(step, STEP), step * scale, at * linear.reduced.torque_scale_nm),
        Property("interface_slip", beyond(slip, SLIP), slip * scale, TIP * linear.reduced.torque_scale_nm),
    )


def beyond(values, threshold: float) -> float:
    """Probability that a size lies beyond a practical threshold, which is itself known to a third only."""
    spread = np.hypot(np.std(values), threshold / 3.0)
    return float(np.clip(ndtr((np.mean(values) - threshold) / spread), 1.0 - SURE, SURE))


def _neighbourhood(branch):
    """Slope around each point without its own neighbours: mean of the medians on both sides, (draws, points)."""
    z, found = branch.z, np.empty_like(branch.slope)
    for i, at in enumerate(z):
        below = (z > at / 1.8) & (z < at / 1.15)
        above = (z > at * 1.15) & (z < at * 1.8)
        sides = [np.median(branch.slope[:, s], axis=1) for s in (below, above) if s.sum() >= 2]
        found[:, i] = np.mean(sides, axis=0) if sides else branch.slope[:, i]
    return np.maximum(found, 0.0)
