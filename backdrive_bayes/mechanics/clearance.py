"""Clearance and free play of the class: steps of the angle at torques of their own, with drag and without."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.mechanics.cells import Cells
from backdrive_bayes.mechanics.part import SHARED, TOP, Part, apart, below

LARGEST_DRAG, ALIKE = 0.15, 0.15
"""Torque about which drag ceases to be usual, and the correlation's length in shares of all knots. These and SHARED: of what was
tried, what made the marginal likelihood of clean units highest on four benches."""
HALVINGS = 4
"""How often the interval of knots next to zero is halved: the width at zero torque is that of a point, block means are not."""
TOPMOST = 3
"""Intervals of knots that make the topmost one: with fewer blocks in it its steps are not told, and loops bend at their tips."""


def clearance(knots) -> Part:
    """Clearances that are crossed forth at one torque and back at the opposite one."""
    cells = Cells(knots[:-1], -knots[1:], np.diff(knots), 2 * _steps(knots))
    return Part("clearance", "geometric", cells, _neighbouring(knots), (float(np.log(0.02)), 1.5))


def free_play(knots) -> Part:
    """Steps without drag: crossed forth and back at the same torque."""
    cells = Cells(knots[:-1], knots[:-1], np.diff(knots), _steps(knots))
    return Part("free_play", "geometric", cells, _neighbouring(knots), (float(np.log(0.003)), 1.0))


def _steps(knots) -> np.ndarray:
    """Torques over which a weight's angle is turned, (cells,): what is turned beyond the largest torque is not seen, or the
    loops would bend at their tips."""
    width = np.diff(knots)
    return np.r_[width[:-1], np.max(np.r_[1.0 - knots[-2], width[-2:-1]])]


def _neighbouring(knots) -> np.ndarray:
    """Root of the prior covariance of steps between knots, (cells, cells): teeth that are crossed at about the same torque make
    them alike, and small against the load; one tooth by itself may be crossed anywhere."""
    level = below(0.5 * (knots[1:] + knots[:-1]), LARGEST_DRAG)
    near = np.exp(-apart(np.linspace(0.0, 1.0, level.size)) / ALIKE)
    return np.linalg.cholesky(SHARED * np.outer(level, level) * near + (1.0 - SHARED) * np.eye(level.size))


def place_knots(torques, most: int, least: float) -> np.ndarray:
    """Knots of clearance and free play at quantiles of the blocks' torques |z|, at least ``least`` apart, from 0 to TOP.

    Blocks are short where the angle moves fast, so the knots are dense where the loops are steep; next to zero they are denser.
    """
    wanted = np.quantile(np.abs(torques), np.linspace(0.0, 1.0, most + 1)[1:-TOPMOST])
    knots = spaced(np.r_[0.0, wanted, TOP], least)
    halved = knots[1] * 0.5 ** np.arange(HALVINGS, 0, -1)
    return np.r_[0.0, halved[halved >= least], knots[1:]]


def spaced(knots, least: float) -> np.ndarray:
    """Rising knots thinned to be at least ``least`` apart, ends kept."""
    kept = [float(knots[0])]
    for value in knots[1:-1]:
        if value - kept[-1] >= least:
            kept.append(float(value))
    return np.array([*kept, float(knots[-1])])


def joined(values, others, least) -> np.ndarray:
    """Rising values (n,) with those of ``others`` (k,) that are further than ``least`` (k,) from each of them."""
    apart = np.abs(others[:, None] - np.r_[values, np.inf]).min(axis=1)
    return np.sort(np.r_[values, others[apart > least]])
