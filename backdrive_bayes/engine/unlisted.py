"""What something unlisted may look like beside a process on each leg: a module that changes in time, a step in time, legs of
the two directions that differ anywhere in the torque."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import Group
from backdrive_bayes.engine.linear import Linear

NODES = np.linspace(-0.98, 0.98, 50)
"""Torques at which legs of the two directions may part."""
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
