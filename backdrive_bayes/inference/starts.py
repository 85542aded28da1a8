"""Where to begin the search for the posterior mode: prior draws, the loop's own features, other pasts of the records."""

from __future__ import annotations

import itertools

import numpy as np

from backdrive_bayes.inference.optimum import climb
from backdrive_bayes.inference.problem import Problem

GRID = 400
SCATTER = 0.7
"""Prior standard deviations by which starts are scattered around a mode."""
RIDGE_STARTS, RIDGE_STEPS = 64, 8
HARDENING_RATIOS, RELEASE_SHARES = (1.0, 0.5), (0.05, 0.25)
FEATURE_STARTS = len(HARDENING_RATIOS) * len(RELEASE_SHARES)


def screened_starts(problem: Problem, rng, candidates: int = 1024, keep: int = 8) -> np.ndarray:
    """The most promising of many prior draws, shape (keep, dimension)."""
    z = rng.normal(size=(candidates, problem.dimension))
    order = np.argsort(-problem.log_posterior(z))
    return z[order[:keep]]


def feature_starts(problem: Problem, rng) -> np.ndarray:
    """Starts (starts, dimension) that read clearance, drag, slope and friction off the widest loop, with the best of many pasts.

    Prior draws alone rarely hit narrow modes; parameters of members that the model does not have are left out.
    """
    starts = []
    for ratio, share in itertools.product(HARDENING_RATIOS, RELEASE_SHARES):
        guess = _features(problem) | {"hardening_ratio": ratio, "release_share": share}
        z = np.zeros(problem.dimension)
        for i, c in enumerate(problem.coordinates):
            if c.parameter.name in guess:
                prior = c.parameter.scaled_prior(problem.model.scale)
                z[i] = np.clip(np.nan_to_num(prior.to_normal(guess[c.parameter.name])), -2.5, 2.5)
        starts.append(with_other_pasts(problem, z, rng, 32))
    return np.array(starts)


def _features(problem) -> dict[str, float]:
    """Rough values of the baseline's parameters [SI] from the last rising and falling branch of the widest loop."""
    data = max(problem.records, key=lambda d: np.ptp(d.blocks.turning_nm))
    blocks, amplitude = data.blocks, 0.5 * np.ptp(data.blocks.turning_nm)
    torque = np.linspace(-0.98, 0.98, GRID) * amplitude
    branch = {}
    for leg, direction in enumerate(blocks.direction):
        own = np.flatnonzero(blocks.leg == leg)
        own = own[np.argsort(blocks.torque_nm[own])]
        if np.ptp(blocks.torque_nm[own]) > 1.5 * amplitude or direction not in branch:
            branch[direction] = np.interp(torque, blocks.torque_nm[own], blocks.angle_rad[own])
    rising, falling = branch.get(1, branch.get(-1)), branch.get(-1, branch.get(1))
    slope, width = np.gradient(rising, torque), np.abs(falling - rising)
    inner = np.abs(torque) < 0.3 * amplitude
    drag = max(float(torque[inner][np.argmax(slope[inner])]), 0.005 * amplitude)
    peak = 0.5 * float(np.ptp(0.5 * (rising + falling)))
    beyond, half = min(3 * drag + 0.02 * amplitude, 0.5 * amplitude), 0.6 * amplitude
    at = {t: float(np.interp(t, torque, width)) for t in (0.0, beyond, half)}
    clearance = max(at[0.0] - at[beyond], 0.02 * peak)
    compliance = max(peak - 0.5 * clearance, 0.1 * peak) / amplitude
    return {
        "clearance": clearance,
        "drag_torque": drag,
        "engagement_torque": 0.5 * clearance / max(float(slope[inner].max()), compliance),
        "release_torque": drag,
        "late_share": 0.1,
        "compliance": compliance,
        "hardening_torque": 0.5 * amplitude,
        "friction_torque": max(0.5 * at[beyond] / compliance, 1e-3 * amplitude),
        "friction_ratio": max(0.5 * (at[half] - at[beyond]) / compliance / (half - beyond), 0.01),
    }


def scattered(z, rng, starts: int = 8) -> np.ndarray:
    """``z`` and starts scattered around it, shape (starts, dimension): ridges and small modes trap a single climb."""
    noise = SCATTER * rng.standard_normal((starts, z.size))
    noise[0] = 0.0
    return z + noise


def along_ridges(problem: Problem, z, rng) -> np.ndarray:
    """Points spread over the posterior around its mode ``z``, shape (points, dimension).

    Parameters that can stand in for each other make curved ridges, far longer than the mode's Gaussian: points scattered as
    widely as the prior and climbed for a few steps lie all along them.
    """
    shared = [c.record is None for c in problem.coordinates]
    starts = np.repeat(z[None], RIDGE_STARTS, axis=0)
    starts[:, shared] += rng.standard_normal((RIDGE_STARTS, sum(shared)))
    points, value = climb(problem, starts, RIDGE_STEPS)
    return points[value > value.max() - problem.dimension]


def with_other_pasts(problem: Problem, z, rng, tries: int = 128) -> np.ndarray:
    """``z`` with the coordinates that belong to one record replaced, record by record, by the best of many prior draws.

    A record's unknown past is a mode of its own that climbing does not leave.
    """
    for record in range(len(problem.records)):
        own = [i for i, c in enumerate(problem.coordinates) if c.record == record]
        trial = np.repeat(z[None], tries, axis=0)
        trial[1:, own] = rng.standard_normal((tries - 1, len(own)))
        z = trial[int(np.argmax(problem.log_posterior(trial)))]
    return z
