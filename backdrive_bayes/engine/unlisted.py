"""What something unlisted may look like beside a process on each leg: a module that changes in time, a step in time, legs of
the two directions that differ anywhere in the torque, a set that grows with the way, a shape or a bump somewhere in the angle."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import Group
from backdrive_bayes.engine.linear import Linear

NODES = np.linspace(-0.98, 0.98, 50)
"""Torques at which legs of the two directions may part."""
PARTS = np.linspace(-1.0, 1.0, 9)
"""Ends of the parts of the torque's range that may each leave a set of its own: small enough to tell tips from the middle."""
PLACES = np.linspace(-1.0, 1.0, 41)
"""Angles of bumps, in shares of half the range: closer than the narrowest is wide."""
WIDTHS = (0.05, 0.1, 0.2)
"""Widths (sd) of a bump that stands alone in the same shares: from a particle's to a tooth's."""
SMOOTH = 0.25
"""Width of those that draw a shape together, half of it apart: they halve the slowest wave that an encoder may have."""
EVERY = 4
"""Blocks between the instants at which a step is looked for: a step's column changes little over a few blocks."""


def module_group(linear: Linear) -> Group:
    """Each module's part of the prediction, constant and growing in time, with weights of each record."""
    modules = sorted({p.module for p in linear.reducer.parts})
    weights, columns = linear.weights, []
    for r, blocks in enumerate(linear.reduced.blocks):
        time = 2.0 * (blocks.mid_s - blocks.begin_s[0]) / (blocks.end_s[-1] - blocks.begin_s[0]) - 1.0
        found = []
        for module in modules:
            names = [p.name for p in linear.reducer.parts if p.module == module]
            part = sum(linear.design.group(n).of_record(r) @ weights[n] for n in names)
            found += [part, part * time]
        columns.append(np.stack(found, axis=1))
    return Group("module_change", tuple(columns), own=True)


def step_group(linear: Linear) -> Group:
    """The angle after each of many instants between blocks that count, with weights of each record."""
    columns = []
    for settled in linear.reduced.settled:
        instants = np.flatnonzero(settled)[EVERY:-EVERY:EVERY]
        columns.append((np.arange(settled.size)[:, None] >= instants).astype(float))
    return Group("step", tuple(columns), own=True)


def uneven_group(linear: Linear) -> Group:
    """Rising legs against mirrored falling ones: a walk along the torque in the direction of motion, the same in all records."""
    columns = []
    for blocks in linear.reduced.blocks:
        along = blocks.torque_nm / linear.reduced.torque_scale_nm * blocks.direction[blocks.leg]
        columns.append((along[:, None] > NODES).astype(float))
    return Group("uneven", tuple(columns))


def ratchet_group(linear: Linear) -> Group:
    """The way that the torque has gone within each of PARTS, in shares of that of the longest record: every passage adds to a
    set."""
    reach, columns = max(np.abs(b.torque_nm).max() for b in linear.reduced.blocks), []
    for blocks in linear.reduced.blocks:
        share = blocks.torque_nm / reach
        inside = np.clip(np.digitize(share, PARTS) - 1, 0, PARTS.size - 2)[:, None] == np.arange(PARTS.size - 1)
        columns.append(np.cumsum(inside * np.abs(np.diff(share, prepend=share[0]))[:, None], axis=0))
    longest = max(c[-1].mean() for c in columns)
    return Group("ratchet", tuple(c / longest for c in columns))


def bump_groups(linear: Linear) -> tuple[Group, Group]:
    """Bumps in the angle that the reducer turns: smooth ones, which together draw any shape that does not repeat, and those of
    all WIDTHS at PLACES, one of which may stand alone."""
    angles = [predicted - waving for predicted, waving in zip(linear.predicted, linear.waving, strict=True)]
    low, high = min(a.min() for a in angles), max(a.max() for a in angles)
    shares = [(2.0 * a - low - high)[:, None] / (high - low) for a in angles]
    smooth = tuple(np.exp(-0.5 * ((s - np.arange(-1.0, 1.0 + SMOOTH / 4, SMOOTH / 2)) / SMOOTH) ** 2) for s in shares)
    alone = tuple(np.hstack([np.exp(-0.5 * ((s - PLACES) / width) ** 2) for width in WIDTHS]) for s in shares)
    return Group("shape", smooth), Group("bump", alone)
