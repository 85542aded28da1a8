"""Effects inside the class: properties of the operator, each with a practical size.

Evidence against the class cannot find what the class holds. What tells a property are the two branches of the settled loop
beside each other. A clearance with drag is crossed while loading and not while unloading, so a second one is a step of the
difference of the branches, in which elasticity cancels and to which friction adds no step. It needs a first one, crossed at less
torque: a reducer may cross its only clearance against much drag. A clamp that slips yields more the nearer the loading branch
comes to the tip, while contacts only harden, and a body that softens does so on both branches. The probability of each is that
of its size among those that are there, not among those that reducers have without it; steps of the unloading branch, where
nothing is crossed, tell how uneven the reading is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, log_ndtr, logsumexp

from backdrive_bayes.engine.levels import learn_scales, levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.gap.averaged import with_columns
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.mechanics.history import through

DRAWS = 120
MEDIAN_SQUARE = 0.455
"""Median of the square of a standard normal variable."""
TORQUES = np.geomspace(0.1, 0.6, 22)
"""Torques, in shares of the largest, about which a second clearance may be crossed; all are as likely."""
WIDTHS = (1.15, 1.25, 1.45)
"""A step is crossed from its torque divided by one of these to its torque times it; flanks as wide lie on both sides."""
SPLITS = np.geomspace(0.01, 0.5, 25)
"""Torques below which a first clearance may be crossed."""
ONSETS = (0.6, 0.7, 0.8, 0.9)
"""Torques from which on a clamp may slip on the settled loading branch; all are as likely."""
BEFORE = 0.3
"""Range of torque below the onset whose compliance is that without slip."""
USUAL = 0.0015
"""Standard deviation of apparent steps that every reducer has, in shares of the angle scale."""
LARGE = 0.06
"""That of a second clearance or of slip where there is one."""
OWN = (0.01, 0.5)
"""Share of reducers whose own clearance is crossed in steps within TORQUES, and the standard deviation of such steps."""
SOFTENING = (0.05, LARGE)
"""Share of reducers that soften towards full load without a clamp that slips, and by how much."""
ODDS = -2.86
"""Log odds that a reducer has one of them: one in eighteen, as any listed effect where LARGE, OWN and SOFTENING were set."""
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
class Branches:
    """Draws of the settled loop at torques ``z`` (points,) from 0 to 1: angle of the loading branch and of the unloading one,
    (draws, points), in angle scales."""

    z: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray


def settled_branches(linear: Linear, rng, draws: int = DRAWS) -> Branches:
    """Draws of the settled loop of the class at the mode's scales."""
    solution = linear.solution
    noise = np.sqrt(solution.variance) * rng.standard_normal((solution.root.shape[1], draws))
    weights = linear.design.split(solution.mean[:, None] + solution.root @ noise)
    half = np.unique(np.r_[0.0, np.geomspace(1e-4, 1.0, 160), np.linspace(0.0, 1.0, 81)])
    path = np.r_[half, half[::-1][1:], -half[1:], -half[::-1][1:], half[1:]]
    columns = linear.reducer.ends(through(np.arange(path.size, dtype=float), path, 1.0))
    angle = sum(columns[n] @ weights[n] for n in columns).T
    turned = half.size - 2
    return Branches(half, angle[:, -half.size :], angle[:, turned : turned + half.size][:, ::-1])


def steps(z, angle, steeper: bool = True) -> np.ndarray:
    """Angle that is crossed about every torque within every width beyond what the flanks give (the steeper of them, or their
    mean), (draws, widths, torques)."""
    found = []
    for width in WIDTHS:
        edges = [np.minimum(TORQUES * width**k, 1.0) for k in (-2, -1, 1, 2)]
        outer, begin, end, beyond = (_at(z, angle, edge) for edge in edges)
        below, above = (begin - outer) / (edges[1] - edges[0]), (beyond - end) / (edges[3] - edges[2])
        flank = 0.5 * (below + above)
        if steeper:
            flank = np.where(below.mean(axis=0) > above.mean(axis=0), below, above)
        found.append(end - begin - flank * (edges[2] - edges[1]))
    return np.stack(found, axis=1)


def crossed_before(z, angle) -> np.ndarray:
    """Angle that is crossed before every step beyond what the flank between gives, split where that is most in the mean over
    draws, (draws, widths, torques)."""
    begin = TORQUES / np.array(WIDTHS)[:, None]
    early = _at(z, angle, SPLITS) - angle[:, :1]
    late = (_at(z, angle, begin.ravel()) - angle[:, :1]).reshape(-1, *begin.shape)
    found, most = np.zeros_like(late), np.full(begin.shape, -np.inf)
    for torque, gained in zip(SPLITS, early.T[..., None, None], strict=True):
        beyond = gained - torque * (late - gained) / np.maximum(begin - torque, SPLITS[0])
        mean = np.where(begin > WIDTHS[0] * torque, beyond.mean(axis=0), -np.inf)
        found, most = np.where(mean > most, beyond, found), np.maximum(most, mean)
    return found


def slips(branches: Branches) -> np.ndarray:
    """Angle gained from every onset to full load beyond what the branch before the onset gives, (draws, onsets): its compliance
    there, and if that grows already, its growth (a body softens little by little)."""
    onset = np.array(ONSETS)
    early, middle, there = (_at(branches.z, branches.loading, x) for x in (onset - BEFORE, onset - 0.5 * BEFORE, onset))
    compliance = (there - early) / BEFORE
    growth = np.maximum((there - 2.0 * middle + early) / (0.5 * BEFORE) ** 2, 0.0)
    left = 1.0 - onset
    return branches.loading[:, -1:] - there - compliance * left - 0.5 * growth * left * (left + BEFORE)


def softens(branches: Branches) -> np.ndarray:
    """Most angle that the unloading branch crosses over a range as long as that from an onset to full load beyond what it crosses
    over as long a range below, (draws, onsets)."""
    found = []
    for length in 1.0 - np.array(ONSETS):
        middle = np.linspace(TORQUES[0] + length, 1.0 - length, TORQUES.size)
        below, there, above = (_at(branches.z, branches.unloading, middle + k * length) for k in (-1, 0, 1))
        more = above - 2.0 * there + below
        found.append(np.maximum(more[:, np.argmax(more.mean(axis=0))], 0.0))
    return np.stack(found, axis=1)


def unevenness(branches: Branches) -> np.ndarray:
    """Variance of what the unloading branch shows as steps beyond its own uncertainty, (widths,)."""
    apparent = steps(branches.z, branches.unloading, steeper=False)
    usual = np.median(apparent.mean(axis=0) ** 2, axis=1) / MEDIAN_SQUARE
    return np.maximum(usual - np.median(apparent.var(axis=0), axis=1), 0.0)


def present(sizes, uneven, own: tuple[float, float]) -> tuple[float, int]:
    """Log Bayes factor that one of the sizes (draws, places), whichever, is of those that are there, and the likeliest place.

    Sizes that are there are half-normal with LARGE, those that every reducer has normal about zero with USUAL and the variance
    ``uneven``; in a share of reducers without the property one place has a size of another origin, half-normal as well (``own``:
    share and standard deviation).
    """
    mean, variance = sizes.mean(axis=0), sizes.var(axis=0) + USUAL**2 + uneven
    there, other = (_gain(mean, variance, sd) for sd in (LARGE, own[1]))
    without = logsumexp([0.0, log_mean(other)], b=[1.0 - own[0], own[0]])
    return float(log_mean(there) - without), int(np.argmax(there))


def find_properties(weighed: Weighed, rng) -> tuple[Property, ...]:
    """Second clearance and interface slip of the operator that is left where the likeliest effects act."""
    linear = _beside_effects(weighed)
    return properties_of(settled_branches(linear, rng), linear.reduced.angle_scale_rad, linear.reduced.torque_scale_nm)


def properties_of(branches: Branches, angle_scale_rad: float, torque_scale_nm: float) -> tuple[Property, ...]:
    """Second clearance and interface slip of a settled loop."""
    apart = branches.loading - branches.unloading
    # A second clearance is as large as the smaller of two.
    crossed = np.minimum(steps(branches.z, apart), crossed_before(branches.z, apart))
    uneven = unevenness(branches)
    # The difference of two branches is as uneven as both.
    twice = np.repeat(2.0 * uneven, TORQUES.size)
    second = crossed.reshape(crossed.shape[0], -1), np.tile(TORQUES, len(WIDTHS)), twice, OWN
    slip = slips(branches) - softens(branches), np.array(ONSETS), uneven[1], SOFTENING
    found = []
    for name, (sizes, torques, variance, own) in (("second_backlash", second), ("interface_slip", slip)):
        log_factor, best = present(sizes, variance, own)
        probability = float(np.clip(expit(log_factor + ODDS), 1.0 - SURE, SURE))
        found.append(Property(name, probability, sizes[:, best] * angle_scale_rad, float(torques[best]) * torque_scale_nm))
    return tuple(found)


def _beside_effects(weighed: Weighed) -> Linear:
    """The linear model solved with the effects that are likeliest, all others at trace level."""
    joint = weighed.joint()
    best = max((h for h in joint if h in weighed.log_factor), key=lambda h: joint[h])
    linear = with_columns(weighed, best)
    return replace(linear, solution=learn_scales(linear, levels(linear, best))[2])


def _gain(mean, variance, large):
    """Log density of sizes of a half-normal prior less that of none, both known with ``variance``."""
    whole = variance + large**2
    shape = log_ndtr(mean * large / np.sqrt(variance * whole)) + 0.5 * mean**2 * large**2 / (variance * whole)
    return np.log(2.0) - 0.5 * np.log(whole / variance) + shape


def _at(z, angle, torques):
    """Angle (draws, torques) between the points of a branch."""
    right = np.clip(np.searchsorted(z, torques), 1, z.size - 1)
    share = (torques - z[right - 1]) / (z[right] - z[right - 1])
    return angle[:, right - 1] * (1.0 - share) + angle[:, right] * share
