"""Mechanical elements of the virtual bench, stepped through the events of a record: sliders, gaps, stops, dashpots.

A slider that is stuck holds its place until the force leaves its friction band and is then dragged along (Jenkins 1962;
Iwan, J. Appl. Mech. 33, 1966); a gap is crossed when the torque overcomes the drag on the part that floats in it; a stop ends a
spring's travel; a dashpot gives way with time (Kelvin-Voigt; Bingham where it has a threshold).
"""

from __future__ import annotations

import numpy as np
from numba import njit


def drag_between(lower, upper, start):
    """Positions of elements that move only when pushed, shape (steps, elements), between bounds of that shape.

    ``start`` (elements,) is where they are before the first step.
    """
    place = np.array(np.broadcast_to(start, lower.shape[1:]), float)
    return _drag(np.ascontiguousarray(lower), np.ascontiguousarray(upper), place)


@njit(cache=True)
def _drag(lower, upper, place):
    moved = np.empty_like(lower)
    for k in range(lower.shape[0]):
        for j in range(lower.shape[1]):
            place[j] = min(max(place[j], lower[k, j]), upper[k, j])
            moved[k, j] = place[j]
    return moved


def sliders(torque_nm, half_width_nm):
    """Torque behind each of a bank of sliders [N·m], shape (steps, elements), from rest.

    ``torque_nm`` has shape (steps,), ``half_width_nm`` (steps, elements): what a slider holds back.
    """
    return _slide(np.asarray(torque_nm, float), np.ascontiguousarray(half_width_nm, float))


@njit(cache=True)
def _slide(torque_nm, half_width_nm):
    moved, place = np.empty_like(half_width_nm), np.zeros(half_width_nm.shape[1])
    for k in range(torque_nm.size):
        for j in range(place.size):
            place[j] = min(max(place[j], torque_nm[k] - half_width_nm[k, j]), torque_nm[k] + half_width_nm[k, j])
            moved[k, j] = place[j]
    return moved


def gaps(torque_nm, drag_nm, centre_nm, rise_nm, fall_nm, start=0.0):
    """Positions from -1 to 1 of parts that float in gaps, shape (steps, elements).

    A part crosses when the torque passes ``centre ± drag``, over a range ±``rise`` upwards and ±``fall`` downwards (film, tooth
    flexure); all [N·m], drag of shape (steps, elements), the others (elements,). ``start`` is where the parts float at first.
    """
    place = np.array(np.broadcast_to(start, centre_nm.shape), float)
    return _cross(np.asarray(torque_nm, float), np.ascontiguousarray(drag_nm, float), centre_nm, rise_nm, fall_nm, place)


@njit(cache=True)
def _cross(torque_nm, drag_nm, centre_nm, rise_nm, fall_nm, place):
    moved = np.empty_like(drag_nm)
    for k in range(torque_nm.size):
        for j in range(place.size):
            drive = torque_nm[k] - centre_nm[j]
            lower = min(max((drive - drag_nm[k, j]) / rise_nm[j], -1.0), 1.0)
            upper = min(max((drive + drag_nm[k, j]) / fall_nm[j], -1.0), 1.0)
            place[j] = min(max(place[j], lower), upper)
            moved[k, j] = place[j]
    return moved


def stops(torque_nm, stop_nm, share):
    """Torque that a chain of springs feels [N·m], shape (steps,), when spring j stops moving at ``stop_nm[j]``."""
    return np.clip(torque_nm[:, None], -stop_nm, stop_nm) @ share


def dashpots(time_s, force, time_constant_s, threshold=0.0):
    """Positions of elements that creep towards ``force`` (steps,), shape (steps, elements).

    Within ``threshold`` of the force an element rests; beyond it relaxes with ``time_constant_s`` (elements,), solved exactly
    for a force constant over a step.
    """
    taus = np.atleast_1d(np.asarray(time_constant_s, float))
    mean = 0.5 * (force[1:] + force[:-1])
    return _creep(mean, np.exp(-np.diff(time_s)[:, None] / taus), float(threshold))


@njit(cache=True)
def _creep(force, fade, threshold):
    crept = np.zeros((force.size + 1, fade.shape[1]))
    for k in range(force.size):
        for j in range(fade.shape[1]):
            over = force[k] - crept[k, j]
            over -= min(max(over, -threshold), threshold)
            crept[k + 1, j] = crept[k, j] + over * (1.0 - fade[k, j])
    return crept


def relaxed(time_s, value, time_constant_s: float):
    """First-order filter of a value that is straight between its times, exact, from rest, shape (steps,)."""
    if time_constant_s <= 0.0:
        return value
    step = np.diff(time_s)
    fade = np.exp(-step / time_constant_s)
    slope = np.diff(value) / np.where(step > 0, step, 1.0)
    return _relax(value, fade, slope * time_constant_s)


@njit(cache=True)
def _relax(value, fade, behind):
    # On a straight stretch the filter's distance to the value tends to slope times time constant.
    out, off = np.empty_like(value), 0.0
    out[0] = value[0]
    for k in range(fade.size):
        off = behind[k] + (off - behind[k]) * fade[k]
        out[k + 1] = value[k + 1] - off
    return out


def slip_while_loading(torque_nm, advance):
    """Irreversible slip (steps,): ``advance`` of the torque's size is added while |torque| grows, with its sign."""
    size = advance(np.abs(torque_nm))
    step = np.maximum(np.diff(size), 0.0) * np.sign(0.5 * (torque_nm[1:] + torque_nm[:-1]))
    return np.r_[0.0, np.cumsum(step)]
