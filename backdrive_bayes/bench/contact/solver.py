"""Equilibria of a chain of contacts, step by step: each step minimises stored energy plus what friction dissipates in it.

With the state of the last step given, every contact's torque is a rising function of one angle, so that the step's energy is
convex and damped Newton finds its only minimum. Incremental energy minimisation: Moreau, in New Variational Techniques in
Mathematical Physics, 1974; contact laws: Johnson, Contact Mechanics, 1985, chapters 4 (Hertz) and 7 (Mindlin, partial slip).
"""

from __future__ import annotations

import numpy as np
from numba import njit

RESIDUAL = 1e-10
STEP = 0.005
"""Largest turn of the output in one step where torque steps can be halved, as a share of the angle scale."""
HALVINGS = 10


@njit(cache=True)
def _turned(angle, j):
    """Turn of a mesh: of a body against the next one, of the last against the locked input."""
    return angle[j] - (angle[j + 1] if j + 1 < angle.size else 0.0)


@njit(cache=True)
def _mesh(chain, j, turned, before, grip, opened):
    """Torque of a mesh and its slope; ``grip`` (flanks,) holds the tangential torques of the last step."""
    side = 1.0 if turned > 0.0 else -1.0
    touch, stiff = (chain.open_up, chain.stiff_up) if turned > 0.0 else (chain.open_down, chain.stiff_down)
    power = chain.power_up[j] if turned > 0.0 else chain.power_down[j]
    torque, slope = chain.film[j] * turned, chain.film[j]
    for i in range(touch.shape[1]):
        depth = side * turned - touch[j, i] - opened
        if depth <= 0.0:
            continue
        load = stiff[j, i] * (depth if power == 1.0 else depth**power)
        rise = power * load / depth
        hold, cap, mu = grip[i] + chain.tangential[j, i] * (turned - before), chain.mu[j, i] * load, chain.mu[j, i]
        if hold > cap:
            hold, held = cap, side * mu * rise
        elif hold < -cap:
            hold, held = -cap, -side * mu * rise
        else:
            held = chain.tangential[j, i]
        torque += side * load + hold
        slope += rise + held
    return torque, slope


@njit(cache=True)
def _regrip(chain, j, turned, before, grip, opened):
    """Tangential torques after the step, in place."""
    side = 1.0 if turned > 0.0 else -1.0
    touch, stiff = (chain.open_up, chain.stiff_up) if turned > 0.0 else (chain.open_down, chain.stiff_down)
    power = chain.power_up[j] if turned > 0.0 else chain.power_down[j]
    for i in range(touch.shape[1]):
        depth = side * turned - touch[j, i] - opened
        cap = chain.mu[j, i] * stiff[j, i] * depth**power if depth > 0.0 else 0.0
        hold = grip[i] + chain.tangential[j, i] * (turned - before)
        grip[i] = min(max(hold, -cap), cap)


@njit(cache=True)
def _bearing(chain, j, move, pull, load):
    """Friction torque of a body's bearing and its slope; ``pull`` (bristles,) are the bristles' torques of the last step."""
    torque, slope, bristles = 0.0, 0.0, pull.size
    extra = chain.bearing_load[j] * max(abs(load) - chain.bearing_onset, 0.0) / bristles
    for m in range(bristles):
        cap = chain.bearing[j, m] + extra
        hold = pull[m] + chain.bristle[j, m] * move
        if abs(hold) <= cap:
            slope += chain.bristle[j, m]
        torque += min(max(hold, -cap), cap)
    return torque, slope


@njit(cache=True)
def _gradient(chain, load, angle, state, gradient, diagonal, coupling):
    """Slope of the step's energy over the bodies' angles, and its tridiagonal curvature, in place."""
    old, grip, pull, opened, stuck = state
    stages = angle.size
    gradient[0] = -load
    for j in range(stages):
        turned = _turned(angle, j)
        before = _turned(old, j)
        torque, slope = _mesh(chain, j, turned, before, grip[j], opened[j])
        friction, held = _bearing(chain, j, angle[j] - old[j], pull[j], load)
        gradient[j] += torque + friction
        diagonal[j] = slope + held + (coupling[j - 1] if j else 0.0)
        coupling[j] = slope
        if j + 1 < stages:
            gradient[j + 1] = -torque
    if chain.stick[3] > 0.0:
        body = int(chain.stick[0])
        gradient[body] += stuck[0] + chain.stick[3] * (angle[body] - old[body])
        diagonal[body] += chain.stick[3]


@njit(cache=True)
def _newton_step(gradient, diagonal, coupling, step):
    """Solution of (tridiagonal curvature) step = -gradient, in place."""
    stages = step.size
    pivot = diagonal.copy()
    for j in range(stages):
        step[j] = -gradient[j]
    for j in range(1, stages):
        factor = coupling[j - 1] / pivot[j - 1]
        pivot[j] -= factor * coupling[j - 1]
        step[j] += factor * step[j - 1]
    for j in range(stages - 1, -1, -1):
        ahead = coupling[j] * step[j + 1] if j + 1 < stages else 0.0
        step[j] = (step[j] + ahead) / pivot[j]


@njit(cache=True)
def _descend(chain, load, angle, step, state, gradient, diagonal, coupling):
    """Go along ``step`` to where the energy no longer falls much, in place: whole step, else Illinois root finding."""
    start, slope = angle.copy(), 0.0
    for j in range(angle.size):
        slope += gradient[j] * step[j]
    low, low_slope, high, high_slope, share, last = 0.0, slope, 1.0, 0.0, 1.0, 0
    for _ in range(40):
        found = 0.0
        for j in range(angle.size):
            angle[j] = start[j] + share * step[j]
        _gradient(chain, load, angle, state, gradient, diagonal, coupling)
        for j in range(angle.size):
            found += gradient[j] * step[j]
        if abs(found) <= -0.3 * slope or (share == 1.0 and found < 0.0):
            return
        if found > 0.0:
            low_slope *= 0.5 if last == 1 else 1.0
            high, high_slope, last = share, found, 1
        else:
            high_slope *= 0.5 if last == -1 else 1.0
            low, low_slope, last = share, found, -1
        share = low + (high - low) * min(max(low_slope / (low_slope - high_slope), 0.02), 0.98)


@njit(cache=True)
def _balance(chain, load, angle, state):
    """Angles of all bodies in equilibrium, in place."""
    gradient, diagonal = np.empty_like(angle), np.empty_like(angle)
    coupling, step = np.empty_like(angle), np.empty_like(angle)
    _gradient(chain, load, angle, state, gradient, diagonal, coupling)
    for _ in range(60):
        largest = 0.0
        for j in range(angle.size):
            largest = max(largest, abs(gradient[j]))
        if largest < RESIDUAL:
            return
        _newton_step(gradient, diagonal, coupling, step)
        _descend(chain, load, angle, step, state, gradient, diagonal, coupling)


@njit(cache=True)
def _commit(chain, load, angle, state):
    """Friction and wear after the step, in place; True where the brittle contact broke and has to be balanced again."""
    old, grip, pull, opened, stuck = state
    stages, broke = angle.size, False
    for j in range(stages):
        turned = _turned(angle, j)
        before = _turned(old, j)
        _regrip(chain, j, turned, before, grip[j], opened[j])
        extra = chain.bearing_load[j] * max(abs(load) - chain.bearing_onset, 0.0) / pull.shape[1]
        for m in range(pull.shape[1]):
            cap = chain.bearing[j, m] + extra
            pull[j, m] = min(max(pull[j, m] + chain.bristle[j, m] * (angle[j] - old[j]), -cap), cap)
        opened[j] += chain.wear * abs(load) * abs(turned - before)
    if chain.stick[3] > 0.0:
        body = int(chain.stick[0])
        stuck[0] += chain.stick[3] * (angle[body] - old[body])
        if abs(stuck[0]) > chain.stick[1]:
            stuck[0], broke = np.sign(stuck[0]) * chain.stick[2], True
    for j in range(stages):
        old[j] = angle[j]
    return broke


@njit(cache=True)
def _advance(chain, load, angle, state):
    """One step to ``load``, in place, slips of the brittle contact included; True if it slipped."""
    slipped = False
    for _ in range(30):
        _balance(chain, load, angle, state)
        if not _commit(chain, load, angle, state):
            break
        slipped = True
    return slipped


@njit(cache=True)
def _torques(chain, load, angle, state, row):
    """Time row of the output: angle of the output shaft, then the torque that each mesh passes on."""
    row[1] = angle[0]
    for j in range(angle.size):
        turned = _turned(angle, j)
        row[2 + j] = _mesh(chain, j, turned, turned, state[1][j], state[3][j])[0]


@njit(cache=True)
def follow(chain, time_s, load, start, largest_step=STEP):
    """Rows (time, output angle, torque of each mesh) along ``load`` (steps,), from angles ``start`` (stages,) free of friction.

    Steps in which the output turns by more than ``largest_step`` are halved, up to HALVINGS times.
    """
    stages = start.size
    angle = start.copy()
    state = (start.copy(), np.zeros_like(chain.mu), np.zeros_like(chain.bearing), np.full(stages, chain.worn), np.zeros(1))
    rows = np.empty((2 * time_s.size + 4096, 2 + stages))
    _advance(chain, load[0], angle, state)
    rows[0, 0] = time_s[0]
    _torques(chain, load[0], angle, state, rows[0])
    count = 1
    for k in range(1, time_s.size):
        done, share = 0.0, 1.0
        while done < 1.0:
            share = min(share, 1.0 - done)
            trial, kept = angle.copy(), (state[0].copy(), state[1].copy(), state[2].copy(), state[3].copy(), state[4].copy())
            here = load[k - 1] + (done + share) * (load[k] - load[k - 1])
            slipped = _advance(chain, here, trial, kept)
            smallest = 0.5**4 if slipped else 0.5**HALVINGS
            if abs(trial[0] - angle[0]) > largest_step and share > smallest:
                share *= 0.5
                continue
            angle, state, done = trial, kept, done + share
            if count == rows.shape[0]:
                rows = np.concatenate((rows, np.empty_like(rows)))
            rows[count, 0] = time_s[k - 1] + done * (time_s[k] - time_s[k - 1])
            _torques(chain, here, angle, state, rows[count])
            count, share = count + 1, 2.0 * share
    return rows[:count]
