"""Parallel contact patches, each elastic up to its limit of friction, under a given torque (Iwan, J. Appl. Mech. 33, 1966)."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def joint_turn(load, stiffness, limit, rest):
    """Turn of a joint (steps,) from rest; patches have ``stiffness`` and ``limit`` (patches,), ``rest`` is a spring beside."""
    held, turn, turns = np.zeros(limit.size), 0.0, np.zeros(load.size)
    for k in range(load.size):
        move = 0.0
        for _ in range(2 * limit.size + 4):
            torque, slope = rest * (turn + move) - load[k], rest
            for i in range(limit.size):
                hold = held[i] + stiffness[i] * move
                slope += stiffness[i] if abs(hold) <= limit[i] else 0.0
                torque += min(max(hold, -limit[i]), limit[i])
            if abs(torque) < 1e-12:
                break
            move -= torque / slope
        for i in range(limit.size):
            held[i] = min(max(held[i] + stiffness[i] * move, -limit[i]), limit[i])
        turn += move
        turns[k] = turn
    return turns
