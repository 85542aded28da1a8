"""Friction: rate-independent with memory, a constant part and a part proportional to the load."""

from __future__ import annotations

import functools
import weakref

import numpy as np

from backdrive_bayes.model.hat_weights import hat_weights
from backdrive_bayes.model.member import Stage
from backdrive_bayes.model.parameter import BoundedLogNormal, Parameter, Uniform
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.play import play

MESH = "weakly informative; losses of a few per cent a mesh and no-load torques in catalogues, short of self-locking"
LOAD_RATIOS = np.array([0.0, 0.01, 0.02, 0.035, 0.055, 0.08, 0.115, 0.16, 0.22, 0.3, 0.42, 0.6, 0.9])
SHIFT_STEP = 0.02
"""Step in T_r between the errors of the torque reading for which the bank is made; between them it is interpolated."""
CONSTANT_SHARES = np.r_[0.0, np.geomspace(0.002, 1.6, 17)]


class Friction:
    """Torque that reaches the elastic parts: a distribution of play operators (Prandtl-Ishlinskii).

    An element holds until the torque has moved by r + m|τ| away from it. r and m are independent and log-normal with means
    ``friction_torque`` and ``friction_ratio`` and log-sds ``friction_spread`` and ``load_spread``, carried by mean-preserving
    hat weights on a fixed grid; ``free_share`` of the torque passes without friction. On saturated branches of a linear
    elastic unit this is the constant ∓d₀ of eq. (20), reconstructed, plus a part that grows with the load.
    """

    name = "friction"
    stage = Stage.TRANSMISSION
    signature = "a loop whose width grows with the load, closed at its tips, independent of the rate"
    source = "play operators for eq. (19)-(20), reconstructed; doi:10.1177/00202940261442382"
    parameters = (
        Parameter("friction_torque", "N·m", "torque", BoundedLogNormal(0.03, 1.0, 0.6), 0.0, MESH),
        Parameter("friction_ratio", "1", "none", BoundedLogNormal(0.05, 1.0, 0.7), 0.0, MESH),
        Parameter("friction_spread", "1", "none", BoundedLogNormal(0.5, 0.5, 1.5), None, "between one threshold and a decade"),
        Parameter("load_spread", "1", "none", BoundedLogNormal(0.5, 0.5, 1.5), None, "between one threshold and a decade"),
        Parameter("free_share", "1", "none", Uniform(0.0, 1.0), None, "no preference"),
        Parameter("initial_friction_state", "1", "none", Uniform(-1.0, 1.0), None, "the unit's past is unknown", True),
    )

    def respond(self, values, drive):
        """Transmitted torque [N·m] of shape (…, samples)."""
        factor, start = drive.friction_factor, values["initial_friction_state"]
        level, ratio = factor * values["friction_torque"] / drive.rated_torque_nm, factor * values["friction_ratio"]
        given = (level, ratio, values["friction_spread"], values["load_spread"], values["free_share"], start, drive.shift_nm)
        given = np.broadcast_arrays(*(np.atleast_1d(np.asarray(v, float)) for v in given))
        # Most of the points of a numerical derivative have their friction in common.
        apart, which = np.unique(np.concatenate(given, axis=-1).reshape(-1, len(given)), axis=0, return_inverse=True)
        *shared, start, shift = (np.ascontiguousarray(column) for column in np.split(apart, len(given), axis=1))
        weights = _weights(*((v.shape, v.tobytes()) for v in shared))
        past = np.concatenate([weights * np.maximum(start, 0), weights * np.maximum(-start, 0)], axis=-1)
        if np.any(shift):
            passed = _passed_shifted(drive, weights, past, shift)
        else:
            passed = _bank(drive.path, drive.rated_torque_nm, 0).passed(weights, past)
        return passed[which.ravel()].reshape(*given[0].shape[:-1], -1)


@functools.lru_cache(maxsize=8)
def _weights(*shared: tuple[tuple[int, ...], bytes]) -> np.ndarray:
    """Weights of the bank's elements, shape (…, elements); records of equal friction ask for the same ones in turn."""
    level, ratio, spread, load_spread, free = (np.frombuffer(data).reshape(shape) for shape, data in shared)
    constant, load = hat_weights(CONSTANT_SHARES, level, spread), hat_weights(LOAD_RATIOS, ratio, load_spread)
    weights = (constant[..., :, None] * load[..., None, :]).reshape(*constant.shape[:-1], -1)
    weights *= 1 - free
    # The first element of the bank has no threshold: it passes the torque as it is.
    weights[..., :1] += free
    weights.flags.writeable = False
    return weights


def _passed_shifted(drive, weights, past, shift_nm):
    """Transmitted torque (points, samples) with the torque reading in error, between the banks of the two nearest shifts."""
    place = shift_nm / (SHIFT_STEP * drive.rated_torque_nm)
    passed = np.zeros((place.size, drive.path.torque_nm.size))
    for node in range(int(np.floor(place.min())), int(np.ceil(place.max())) + 1):
        hat = np.maximum(1 - np.abs(place - node), 0)
        own = hat[:, 0] > 0
        if own.any():
            bank = _bank(drive.path, drive.rated_torque_nm, node)
            passed[own] += bank.passed((hat * weights)[own], (hat * past)[own])
    return passed


class _Bank:
    """Play operators of all grid thresholds along one path, for three past states.

    ``neutral`` (elements, samples) starts from rest. ``past`` (2 · elements, early samples) is the change when every element
    starts at the upper end of its band (first half) or at the lower end, kept for the samples that remember it.
    """

    def __init__(self, path: TorquePath, rated_torque_nm: float, shift_nm: float):
        constant = np.repeat(CONSTANT_SHARES * rated_torque_nm, LOAD_RATIOS.size)[:, None]
        ratio = np.tile(LOAD_RATIOS, CONSTANT_SHARES.size)[:, None]

        def lower(torque):
            return torque - constant - ratio * np.abs(torque)

        self.neutral = play(path, lower, np.zeros_like(constant), shift_nm)
        past = np.concatenate(
            [play(path, lower, np.full_like(constant, end), shift_nm) - self.neutral for end in (np.inf, -np.inf)]
        )
        remembered = np.flatnonzero(np.any(past != 0, axis=0))
        self.past = past[:, : int(remembered[-1]) + 1 if remembered.size else 0].copy()


    def passed(self, weights, past):
        """Transmitted torque for ``weights`` (…, elements) and those of the two past states, ``past`` (…, 2 · elements)."""
        passed = np.matmul(weights, self.neutral)
        passed[..., : self.past.shape[-1]] += np.matmul(past, self.past)
        return passed


_banks: weakref.WeakKeyDictionary[TorquePath, dict[tuple[float, int], _Bank]] = weakref.WeakKeyDictionary()


def _bank(path: TorquePath, rated_torque_nm: float, shift_node: int) -> _Bank:
    banks = _banks.setdefault(path, {})
    key = (rated_torque_nm, shift_node)
    if key not in banks:
        banks[key] = _Bank(path, rated_torque_nm, shift_node * SHIFT_STEP * rated_torque_nm)
    return banks[key]
