"""What the solver integrates: a chain of nodes as plain arrays, in shares of rated torque and angle scale, seconds in time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from backdrive_bayes.bench.ode.contact import compliance_table
from backdrive_bayes.bench.ode.reducer import OdeReducer

VISCOUS = 1e-10
"""Oil drag of a clean node in T_r·s over angle scales: true to an ODE in time, and far too small to be seen."""


class Chain(NamedTuple):
    """Nodes 0 (output) to n-1 and the element below each.

    ``table_torque``, ``table_travel``, ``table_extra`` (n, nodes): compliance D(M) and its modulated part W(M), so that travel
    is D + m(t) W. ``constant``, ``ratio`` (n,): friction level constant + ratio |M|^``load_power``. ``bend``, ``share``,
    (n, kinds): presliding travel and share of each kind of bristles, ``exponent`` Dahl's. ``bump`` (3,): height, position and
    width of a patch of raised friction at the output node. ``rate_law`` (6,): law, reference speed, direct change, change
    with memory, slip distance of the memory, exponent. ``creep_compliance``, ``creep_s`` (modes,): Kelvin-Voigt elements in the
    lowest element, ``creep_power`` the exponent of their load.
    """

    table_torque: np.ndarray
    table_travel: np.ndarray
    table_extra: np.ndarray
    constant: np.ndarray
    ratio: np.ndarray
    bend: np.ndarray
    share: np.ndarray
    exponent: float = 1.0
    load_power: float = 1.0
    viscous: float = VISCOUS
    bump: np.ndarray = np.array([0.0, 0.0, 1.0])
    rate_law: np.ndarray = np.array([0.0, 1.0, 0.0, 0.0, 1.0, 1.0])
    creep_compliance: np.ndarray = np.zeros(0)
    creep_s: np.ndarray = np.ones(0)
    creep_power: float = 1.0


def stack_tables(tables):
    """Tables of unequal length as two arrays (n, nodes); short ones go on straight at both ends."""
    longest = max(torque.size for torque, _ in tables)
    return tuple(np.array(rows) for rows in zip(*(_pad(*table, longest) for table in tables), strict=True))


def make_chain(reducer: OdeReducer) -> Chain:
    """The chain of a clean reducer, whose travel at T_r is one angle scale in spite of its friction."""
    torque, travel = stack_tables([compliance_table(mesh) for mesh in reducer.meshes()])
    torque = torque * reducer.carried()[:, None]
    constant, ratio = reducer.levels()
    bend = reducer.presliding * np.array([1.0, reducer.bristle_ratio])
    share = np.array([1.0 - reducer.bristle_share, reducer.bristle_share])
    bends, shares = np.tile(bend, (constant.size, 1)), np.tile(share, (constant.size, 1))
    return Chain(torque, travel, np.zeros_like(torque), constant, ratio, bends, shares, reducer.bristle_power)


def coupling(torque, travel, friction: float, bend: float) -> Chain:
    """A chain of one node: a spring with this table, and friction that rubs along its travel."""
    table = (torque[None, :], travel[None, :], np.zeros((1, torque.size)))
    return Chain(*table, np.array([friction]), np.zeros(1), np.array([[bend]]), np.ones((1, 1)))


def _pad(torque, travel, longest):
    missing = longest - torque.size
    below, above = np.arange(missing // 2, 0, -1.0), np.arange(1.0, missing - missing // 2 + 1.0)
    slope = (travel[-1] - travel[-2]) / (torque[-1] - torque[-2])
    longer = np.concatenate([torque[0] - below, torque, torque[-1] + above])
    return longer, np.concatenate([travel[0] - slope * below, travel, travel[-1] + slope * above])
