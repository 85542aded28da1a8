"""Bristle friction: Dahl's and LuGre's equations, each solved exactly along a step of given travel.

Sources: Dahl, Aerospace Corp. TOR-158, 1968; Canudas de Wit et al., IEEE Trans. Autom. Control 40, 1995 (LuGre); Ruina, J.
Geophys. Res. 88, 1983 (memory of the level over a slip distance).
"""

from __future__ import annotations

import math

import numba

LOGARITHM, POWER, SATURATING = 1.0, 2.0, 3.0
LEAST_LEVEL = 0.05


@numba.njit(cache=True)
def bent(bristle, travel, bend, level, exponent):
    """Bristle deflection over its limit after ``travel``, towards ±``level`` over the distance ``bend``."""
    if travel == 0.0:
        return bristle
    side = 1.0 if travel > 0.0 else -1.0
    way = abs(travel) / (bend * level)
    left = 1.0 - side * bristle / level
    if exponent == 1.0:
        return side * level * (1.0 - left * math.exp(-way))
    size = abs(left)
    if size < 1e-300:
        return side * level
    rest = size ** (1.0 - exponent) + (exponent - 1.0) * way
    new = rest ** (1.0 / (1.0 - exponent)) if rest > 0.0 else 0.0
    return side * level * (1.0 - math.copysign(new, left))


@numba.njit(cache=True)
def speed_measure(speed, rate_law):
    """What the level of friction follows: decades, a power or a saturating function of the speed over the reference."""
    ratio = speed / rate_law[1]
    if rate_law[0] == LOGARITHM:
        return math.log1p(ratio) / math.log(10.0)
    power = ratio ** rate_law[5]
    return power if rate_law[0] == POWER else power / (1.0 + power)


@numba.njit(cache=True)
def remembered(memory, travel, measure, distance):
    """Memory of the speed measure after ``travel``, which forgets over the slip ``distance``."""
    return measure + (memory - measure) * math.exp(-abs(travel) / distance)


@numba.njit(cache=True)
def sliding_level(measure, memory, rate_law):
    """Level of sliding friction over its clean value."""
    return max(LEAST_LEVEL, 1.0 + rate_law[2] * measure + rate_law[3] * memory)
