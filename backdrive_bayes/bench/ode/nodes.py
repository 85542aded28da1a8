"""One implicit step of the chain: from a torque in the lowest element up to the torque that the output needs."""

from __future__ import annotations

import math

import numba
import numpy as np

from backdrive_bayes.bench.ode.bristles import bent, remembered, sliding_level, speed_measure


@numba.njit(cache=True)
def travel_at(torque, nodes, values):
    """Piecewise linear table, straight beyond its ends."""
    k = np.searchsorted(nodes, torque) - 1
    k = min(max(k, 0), nodes.size - 2)
    return values[k] + (values[k + 1] - values[k]) * (torque - nodes[k]) / (nodes[k + 1] - nodes[k])


@numba.njit(cache=True)
def bump_at(angle, bump):
    """Factor on friction at the output node where the mesh angle passes a rough patch."""
    if bump[0] == 0.0:
        return 1.0
    return max(0.05, 1.0 + bump[0] * math.exp(-0.5 * ((angle - bump[1]) / bump[2]) ** 2))


@numba.njit(cache=True)
def creep_load(torque, power):
    """Load that creep follows."""
    return math.copysign(abs(torque) ** power, torque) if power != 1.0 else torque


@numba.njit(cache=True)
def crept(chain, creep, old_torque, torque, step_s, out):
    """Kelvin-Voigt deflections after a step in which their load is linear in time; returns their sum."""
    total = 0.0
    old, new = creep_load(old_torque, chain.creep_power), creep_load(torque, chain.creep_power)
    for k in range(chain.creep_compliance.size):
        way = step_s / chain.creep_s[k]
        keep = math.exp(-way)
        mean = -math.expm1(-way) / way if way > 1e-9 else 1.0 - 0.5 * way
        out[k] = keep * creep[k] + chain.creep_compliance[k] * (new * (1.0 - mean) + old * (mean - keep))
        total += out[k]
    return total


@numba.njit(cache=True)
def output_torque(torque, chain, state, trial, step_s, widen, rub):
    """Torque at the output when the lowest element carries ``torque``; the state that goes with it is left in ``trial``.

    A state is (positions (n,), bristles (n, kinds), memories (n,), creep (modes,), lowest torque (1,)). ``widen`` is the
    modulation m of the tables, ``rub`` a factor on friction.
    """
    place, bristle, memory, creep, lowest = state
    angle = crept(chain, creep, lowest[0], torque, step_s, trial[3])
    trial[4][0] = torque
    for i in range(place.size - 1, -1, -1):
        angle += travel_at(torque, chain.table_torque[i], chain.table_travel[i])
        if widen != 0.0:
            angle += widen * travel_at(torque, chain.table_torque[i], chain.table_extra[i])
        trial[0][i] = angle
        moved = angle - place[i]
        level = 1.0
        if chain.rate_law[0] != 0.0:
            measure = speed_measure(abs(moved) / step_s, chain.rate_law)
            trial[2][i] = remembered(memory[i], moved, measure, chain.rate_law[4])
            level = sliding_level(measure, trial[2][i], chain.rate_law)
        held = 0.0
        for j in range(bristle.shape[1]):
            trial[1][i, j] = bent(bristle[i, j], moved, chain.bend[i, j], level, chain.exponent)
            held += chain.share[i, j] * trial[1][i, j]
        friction = chain.constant[i] + chain.ratio[i] * abs(creep_load(torque, chain.load_power))
        friction *= rub * (bump_at(angle, chain.bump) if i == 0 else 1.0)
        torque += friction * held + chain.viscous * moved / step_s
    return torque


@numba.njit(cache=True)
def solve_step(wanted, guess, chain, state, trial, step_s, widen, rub):
    """Find the lowest element's torque for the ``wanted`` output torque: outward to a bracket, then Chandrupatla's method."""
    a = state[4][0]
    fa = output_torque(a, chain, state, trial, step_s, widen, rub) - wanted
    reach = max(abs(guess), 1e-9)
    b, fb = a, fa
    for _ in range(80):
        if fa == 0.0:
            return a
        b = a - math.copysign(reach, fa)
        fb = output_torque(b, chain, state, trial, step_s, widen, rub) - wanted
        if fa * fb <= 0.0:
            break
        a, fa, reach = b, fb, 2.0 * reach
    return _between(a, fa, b, fb, wanted, chain, state, trial, step_s, widen, rub)


@numba.njit(cache=True)
def _between(a, fa, b, fb, wanted, chain, state, trial, step_s, widen, rub):
    """Chandrupatla, Adv. Eng. Softw. 28, 1997: inverse quadratic steps where they are safe, halving elsewhere."""
    c, fc, share = a, fa, 0.5
    for _ in range(100):
        x = a + share * (b - a)
        fx = output_torque(x, chain, state, trial, step_s, widen, rub) - wanted
        if fx * fa > 0.0:
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        if min(abs(fa), abs(fb)) < 1e-13 or abs(b - a) < 1e-15 * (1e-3 + abs(best)):
            if best != x:
                output_torque(best, chain, state, trial, step_s, widen, rub)
            return best
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        share = 0.5
        if phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            share = min(max(share, 1e-9), 1.0 - 1e-9)
    return a
