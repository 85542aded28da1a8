"""Mechanical elements of the virtual bench, stepped through the events of a record: sliders, gaps, stops, dashpots.

A slider that is stuck holds its place until the force leaves its friction band and is then dragged along (Jenkins 1962;
Iwan, J. Appl. Mech. 33, 1966); a gap is crossed when the torque overcomes the drag on the part that floats in it; a stop ends a
spring's travel; a dashpot gives way with time (Kelvin-Voigt; Bingham where it has a threshold).
"""

from __future__ import annotations

import numpy as np


def drag_between(lower, upper, start):
    """Positions of elements that move only when pushed, shape (steps, elements), between bounds of that shape.

    ``start`` (elements,) is where they are before the first step.
    """
    place = np.array(np.broadcast_to(start, lower.shape[1:]), float)
    moved = np.empty_like(lower)
    for low, high, out in zip(lower, upper, moved, strict=True):
        np.maximum(place, low, out=place)
        np.minimum(place, high, out=place)
        out[:] = place
    return moved


def sliders(torque_nm, half_width_nm):
    """Torque behind each of a bank of sliders [N·m], shape (steps, elements), from rest.

    ``torque_nm`` has shape (steps,), ``half_width_nm`` (steps, elements): what a slider holds back.
    """
    drive = torque_nm[:, None]
    return drag_between(drive - half_width_nm, drive + half_width_nm, np.zeros(half_width_nm.shape[1]))


def gaps(torque_nm, drag_nm, centre_nm, rise_nm, fall_nm, start=0.0):
    """Positions from -1 to 1 of parts that float in gaps, shape (steps, elements).

    A part crosses when the torque passes ``centre ± drag``, over a range ±``rise`` upwards and ±``fall`` downwards (film, tooth
    flexure); all [N·m], drag of shape (steps, elements), the others (elements,). ``start`` is where the parts float at first.
    """
    drive = torque_nm[:, None] - centre_nm
    lower = np.clip((drive - drag_nm) / rise_nm, -1.0, 1.0)
    upper = np.clip((drive + drag_nm) / fall_nm, -1.0, 1.0)
    return drag_between(lower, upper, np.broadcast_to(start, centre_nm.shape))


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
    fade = np.exp(-np.diff(time_s)[:, None] / taus)
    place = np.zeros(taus.shape)
    crept = np.zeros((force.size, taus.size))
    for k, (push, decay) in enumerate(zip(mean, fade, strict=True), start=1):
        over = push - place
        over = over - np.clip(over, -threshold, threshold)
        place = place + over * (1.0 - decay)
        crept[k] = place
    return crept


def slip_while_loading(torque_nm, advance):
    """Irreversible slip (steps,): ``advance`` of the torque's size is added while |torque| grows, with its sign."""
    size = advance(np.abs(torque_nm))
    step = np.maximum(np.diff(size), 0.0) * np.sign(0.5 * (torque_nm[1:] + torque_nm[:-1]))
    return np.r_[0.0, np.cumsum(step)]
