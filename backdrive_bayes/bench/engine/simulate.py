"""Runs of the engine along a sequence of torques: the train, and hinges in series with it."""

from __future__ import annotations

import math
from functools import lru_cache

import numba
import numpy as np

from backdrive_bayes.bench.engine.rows import REST_STEPS, load_engine, raise_if_unstable, weight_of_dashpot
from backdrive_bayes.bench.engine.train import Train, build_train


def train_angle(train: Train, torque, step_s, floating: float):
    """Angle of the output over the angle scale, shape (steps,), for ``torque`` over T_r at steps that last ``step_s`` seconds.

    ``floating`` from -1 to 1 says where in their clearances the bodies are at first.
    """
    durations = np.asarray(step_s if train.viscous else ())
    return _run(train, np.asarray(torque).tobytes(), durations.tobytes(), float(floating)).copy()


@lru_cache(maxsize=48)
def _run(train, torque_bytes, step_bytes, floating):
    # Records of one shape and effects of the channel share a run: the engine's clock knows torque, not time.
    torque, step_s = np.frombuffer(torque_bytes), np.frombuffer(step_bytes)
    model, data, dashpots = build_train(train)
    data.qpos[:] = floating * np.cumsum([link.clearance for link in train.links][::-1])[::-1]
    rest = np.zeros(REST_STEPS)
    step_s = np.r_[rest + 1.0, step_s] if step_s.size else np.ones(rest.size + torque.size)
    drag = np.outer(weight_of_dashpot(train.viscous / step_s), np.ones(len(dashpots))) if dashpots else None
    found = _advance(train, model, data, np.r_[rest, torque], dashpots, drag)[REST_STEPS:]
    raise_if_unstable(data)
    return found


@numba.njit(cache=True)
def _press(friction, row_force, first, load, constant, slope, level, stuck):
    """Sets bearing friction by the torque that each body passes on; the solver's friction rows begin at ``first``.

    Stuck bearings have more of it where the load is above what friction alone carries and squeezes out the lubricant.
    """
    passed, light = load, 2.0 * constant.sum()
    for i in range(friction.size):
        passed += row_force[first + i]
        squeezed = 1.0 - (light / passed) ** 2 if abs(passed) > light else 0.0
        friction[i] = (level[i] + stuck[i] * squeezed) * (constant[i] + slope[i] * abs(passed))


def _advance(train, model, data, torque, dashpots, drag):
    """Output angle at every step; bearing friction follows the torque that each body passes on and how it has slid."""
    step, applied, angle, speed, first = load_engine().mj_step, data.qfrc_applied, data.qpos, data.qvel, model.neq
    friction, constant, slope = model.dof_frictionloss, np.maximum(train.friction, 1e-9), np.array(train.load_friction)
    depth, period, phase = train.cogging
    found, drive = np.empty(torque.size), _drive_speed(train, torque).tolist()
    level = np.ones(constant.size)
    stuck, slid, sliding = np.zeros((3, constant.size))
    for i, load in enumerate(torque.tolist()):
        applied[0] = load - depth * math.sin(2.0 * math.pi * angle[0] / period + phase)
        if dashpots:
            model.tendon_invweight0[dashpots] = drag[i]
        step(model, data)
        found[i] = angle[0]
        _slide(level, stuck, slid, sliding, speed, drive[i], train.static, train.running_in)
        _press(friction, data.efc_force, first, load, constant, slope, level, stuck)
    return found


@numba.njit(cache=True)
def _slide(level, stuck, slid, sliding, speed, drive, static, running_in):
    """Updates each bearing's friction level by what it has slid so far, and its static excess."""
    for i in range(level.size):
        moved = abs(speed[i])
        slid[i] += moved
        # A bearing that has broken loose slides on until it is no faster than the load drives it.
        sliding[i] = moved > (3.0 if sliding[i] else 0.05) * drive
        stuck[i] = 0.0 if sliding[i] else static
        level[i] = 1.0 - running_in * (1.0 - np.exp(-slid[i] / 3.0))


def _drive_speed(train, torque):
    """Angle per step at which the load alone would drive the whole chain."""
    rate = np.abs(np.gradient(torque)) if torque.size > 1 else np.ones(1)
    return np.maximum(rate, 1e-6) * sum(link.compliance for link in train.links)
