"""The chain followed through time, with steps as fine as the loop is bent."""

from __future__ import annotations

import numba
import numpy as np

from backdrive_bayes.bench.ode.nodes import solve_step, travel_at

TOLERANCE = 1e-6
"""Largest departure of the angle from a straight line between steps, in angle scales."""
MOST_TRAVEL = 0.02
"""Largest travel of the output in one step, in angle scales: effects that wave along the angle are followed."""
LEAST_STEP = 1e-6
"""Smallest step as a share of a base interval."""


def follow(chain, time_s, torque, widen, rub, floating: float = 0.0, tolerance: float = TOLERANCE):
    """Times and output angle of the chain, two arrays of shape (steps,).

    ``time_s``, ``torque``, ``widen`` and ``rub`` (base points,) are joined by straight lines; all base points are kept.
    """
    start = 0.95 * floating * _free_torque(chain)
    return _follow(chain, time_s, torque, widen, rub, start, tolerance)


def _free_torque(chain):
    """Torque of the centring spring at the end of the free travel: where the output's compliance first falls."""
    middle = chain.table_torque[0].size // 2
    slope = np.diff(chain.table_travel[0][middle:]) / np.diff(chain.table_torque[0][middle:])
    end = chain.table_torque[0][middle + int(np.argmax(slope < 0.7 * slope[0]))]
    return min(end, 0.9 * float(chain.constant[0]))


@numba.njit(cache=True)
def _blank(chain):
    n, kinds = chain.bend.shape
    return np.zeros(n), np.zeros((n, kinds)), np.zeros(n), np.zeros(chain.creep_s.size), np.zeros(1)


@numba.njit(cache=True)
def _keep(state, trial):
    """Copy one state into the other; by elements, for numba compiles a check of shapes for as long as all else here."""
    for i in range(state[0].size):
        state[0][i], state[2][i] = trial[0][i], trial[2][i]
        for m in range(state[1].shape[1]):
            state[1][i, m] = trial[1][i, m]
    for i in range(state[3].size):
        state[3][i] = trial[3][i]
    state[4][0] = trial[4][0]


@numba.njit(cache=True)
def _begin(chain, start):
    """A state without load, its free parts pushed to one side and held there by the bristles."""
    state = _blank(chain)
    state[4][0] = start
    angle = 0.0
    for i in range(state[0].size - 1, -1, -1):
        angle += travel_at(start, chain.table_torque[i], chain.table_travel[i])
        state[0][i] = angle
    if chain.constant[0] > 0.0:
        state[1][0, :] = -start / chain.constant[0]
    return state


@numba.njit(cache=True)
def _follow(chain, time_s, torque, widen, rub, start, tolerance):
    state, trial = _begin(chain, start), _blank(chain)
    times, angles, count = np.empty(4096), np.empty(4096), 1
    solve_step(torque[0], 1e-6, chain, state, trial, 1.0, widen[0], rub[0])
    _keep(state, trial)
    times[0], angles[0] = time_s[0], state[0][0]
    slope, last, gain, before, trust = 0.0, 1.0, 1.0, 0.0, False
    step = 1e-3
    for k in range(time_s.size - 1):
        whole = time_s[k + 1] - time_s[k]
        rise = torque[k + 1] - torque[k]
        if rise * before <= 0.0:
            trust, step = False, 1e-3
        before, share = rise, 0.0
        while share < 1.0:
            step = 1.0 - share if share + 1.2 * step > 1.0 else step
            here = share + step
            passed = whole * step
            was, low = state[0][0], state[4][0]
            wanted = torque[k] + here * rise
            now_widen, now_rub = widen[k] + here * (widen[k + 1] - widen[k]), rub[k] + here * (rub[k + 1] - rub[k])
            lowest = solve_step(wanted, gain * step * rise, chain, state, trial, passed, now_widen, now_rub)
            new = (trial[0][0] - was) / passed
            off = abs(new - slope) * passed * passed / (4.0 * (passed + last)) if trust else 0.1 * tolerance
            if (off > 2.0 * tolerance or abs(trial[0][0] - was) > MOST_TRAVEL) and step > LEAST_STEP:
                step = max(0.4 * step, LEAST_STEP)
                continue
            _keep(state, trial)
            gain = (lowest - low) / (step * rise) if rise != 0.0 else 0.0
            slope, last, trust, share = new, passed, True, here
            if count == times.size:
                times, angles = np.concatenate((times, np.empty(count))), np.concatenate((angles, np.empty(count)))
            times[count], angles[count] = time_s[k] + here * whole, trial[0][0]
            count += 1
            step = min(1.0, step * min(2.0, max(0.5, 0.9 * (tolerance / max(off, 1e-12)) ** 0.5)))
        times[count - 1] = time_s[k + 1]
    return times[:count].copy(), angles[:count].copy()
