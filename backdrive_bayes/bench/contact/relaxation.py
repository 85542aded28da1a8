"""Linear relaxation towards a signal that is straight between its samples, solved exactly."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def relax(time_s, target, pole_s):
    """State (steps,), complex, of dy/dt = (target - y) / pole_s, at rest before the first sample; ``pole_s`` may be complex."""
    state = np.empty(time_s.size, np.complex128)
    state[0] = target[0]
    for k in range(1, time_s.size):
        step = time_s[k] - time_s[k - 1]
        if step <= 0.0:
            state[k] = state[k - 1]
            continue
        behind = (target[k] - target[k - 1]) * pole_s / step
        state[k] = target[k] - behind + (state[k - 1] - target[k - 1] + behind) * np.exp(-step / pole_s)
    return state


def relaxed_at(time_s, target, pole_s, at_s):
    """The same state at times ``at_s`` (samples,) between the samples."""
    state = relax(time_s, target, complex(pole_s))
    k = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, time_s.size - 2)
    step = np.maximum(time_s[k + 1] - time_s[k], 1e-15)
    slope, passed = (target[k + 1] - target[k]) / step, at_s - time_s[k]
    behind = slope * pole_s
    return target[k] + slope * passed - behind + (state[k] - target[k] + behind) * np.exp(-passed / pole_s)


@njit(cache=True)
def yielding_relax(time_s, target, constant_s, threshold):
    """State (steps,) that rests within ``threshold`` of the target and relaxes towards it beyond (Bingham element)."""
    state = np.zeros(time_s.size)
    for k in range(1, time_s.size):
        over = 0.5 * (target[k] + target[k - 1]) - state[k - 1]
        over -= min(max(over, -threshold), threshold)
        state[k] = state[k - 1] + over * (1.0 - np.exp(-(time_s[k] - time_s[k - 1]) / constant_s))
    return state
