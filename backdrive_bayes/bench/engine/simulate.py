"""Runs of the engine along a sequence of torques: the train, and hinges in series with it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from backdrive_bayes.bench.engine.rows import REST_STEPS, load_engine, weight_of_dashpot
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
    special = train.static or train.running_in or train.cogging[0] or train.viscous
    advance = _advance_with_extras if special else _advance
    step_s = np.r_[rest + 1.0, step_s] if step_s.size else np.ones(rest.size + torque.size)
    drag = np.outer(weight_of_dashpot(train.viscous / step_s), np.ones(len(dashpots))) if dashpots else None
    return advance(train, model, data, np.r_[rest, torque], (dashpots, drag))[REST_STEPS:]


def _advance(train, model, data, torque, _):
    """Output angle at every step; bearing friction follows the torque that each body passes on."""
    step, applied, angle = load_engine().mj_step, data.qfrc_applied, data.qpos
    friction, constant, slope = model.dof_frictionloss, np.maximum(train.friction, 1e-9), np.array(train.load_friction)
    found = np.empty(torque.size)
    for i, load in enumerate(torque.tolist()):
        applied[0] = load
        step(model, data)
        found[i] = angle[0]
        friction[:] = constant + slope * np.abs(_passed(data, load))
    return found


def _passed(data, load):
    """Torque that each body passes on to the next, from the bearing friction the solver found."""
    return load + np.cumsum(data.efc_force[data.ne : data.ne + data.qpos.size])


def _advance_with_extras(train, model, data, torque, drag):
    """As _advance, with static friction, bearing drag in true time, running-in and cogging."""
    step, applied, angle, speed = load_engine().mj_step, data.qfrc_applied, data.qpos, data.qvel
    constant, slope = np.maximum(train.friction, 1e-9), np.array(train.load_friction)
    (depth, period, phase), (dashpots, weights) = train.cogging, drag
    found, slid = np.empty(torque.size), np.zeros(constant.size)
    sliding, drive = np.zeros(constant.size, bool), _drive_speed(train, torque)
    for i, load in enumerate(torque.tolist()):
        applied[0] = load - depth * np.sin(2.0 * np.pi * angle[0] / period + phase)
        if dashpots:
            model.tendon_invweight0[dashpots] = weights[i]
        step(model, data)
        found[i] = angle[0]
        moved = np.abs(speed)
        slid += moved
        # A bearing that has broken loose slides on until it is no faster than the load drives it.
        sliding = np.where(sliding, moved > 3.0 * drive[i], moved > 0.05 * drive[i])
        level = 1.0 + train.static * ~sliding - train.running_in * (1.0 - np.exp(-slid / 3.0))
        model.dof_frictionloss[:] = level * (constant + slope * np.abs(_passed(data, load)))
    return found


def _drive_speed(train, torque):
    """Angle per step at which the load alone would drive the whole chain."""
    rate = np.abs(np.gradient(torque)) if torque.size > 1 else np.ones(1)
    return np.maximum(rate, 1e-6) * sum(link.compliance for link in train.links)
