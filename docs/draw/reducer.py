"""A made-up reducer whose loops the drawings show: elastic, with friction and a clearance, in shares of torque and angle."""

from __future__ import annotations

import numpy as np

THRESHOLDS = np.array([0.06, 0.15, 0.3, 0.5])
SHARES = np.array([0.10, 0.12, 0.08, 0.05])
CROSSED, WIDTH = 0.10, 0.10
"""The clearance is crossed between these torques, up and (mirrored) down."""
CLEARANCE = 0.55
POINTS = 400


def elastic(z):
    """Odd compliance that hardens."""
    return 0.42 * z - 0.10 * z**3


def friction(z):
    """Sum of play operators that begin neutral."""
    total = np.zeros(z.size)
    for threshold, share in zip(THRESHOLDS, SHARES, strict=True):
        x = 0.0
        for i, value in enumerate(z):
            x = min(max(x, value - threshold), value + threshold)
            total[i] += share * x
    return total


def clearance(z, crossed=CROSSED, width=WIDTH, size=CLEARANCE, start=0.5):
    """Relays that close between ``crossed`` and ``crossed + width`` and open at the mirrored torques."""
    x, out = start * width, np.empty(z.size)
    for i, value in enumerate(z):
        x = max(x, min(max(value - crossed, 0.0), width))
        x = min(x, min(max(value + crossed + width, 0.0), width))
        out[i] = size * (x / width - 0.5)
    return out


def angle(z):
    """The reducer's answer to a torque history, from rest."""
    return elastic(z) + friction(z) + clearance(z)


def path(*turning, points=POINTS):
    """Straight torque history through turning points."""
    legs = [np.linspace(a, b, points)[:-1] for a, b in zip(turning[:-1], turning[1:], strict=True)]
    return np.concatenate([*legs, [turning[-1]]])


def loop(amplitude=1.0, of=angle, points=POINTS):
    """Torque rising (points,), angle on the ascending and on the descending branch of the settled loop."""
    z = path(0, amplitude, -amplitude, amplitude, -amplitude, points=points)
    answer = of(z)
    rising, falling = answer[2 * (points - 1) : 3 * points - 2], answer[3 * (points - 1) :]
    return z[2 * (points - 1) : 3 * points - 2], rising, falling[::-1]


def first_loading(amplitude=1.0):
    """The virgin curve from zero to ``amplitude``."""
    z = path(0, amplitude)
    return z, angle(z)
