"""Overlap of the gap's map with the truth: the sum over cells of the smaller of two shares."""

from __future__ import annotations

import numpy as np


def overlap(truth: list[dict] | None, cells) -> float | None:
    """Overlap from 0 to 1 of a true map (truth_map.py) and the cells of where.map; None where either is empty.

    Cells are record × branch × torque bin of the truth; an answer's share is spread evenly over the torque of its own cell,
    cycles are added up, and its shares are taken relative to their sum.
    """
    if truth is None:
        return None
    total = sum(max(float(cell["share"]), 0.0) for cell in cells)
    if total <= 0.0:
        return None
    found = 0.0
    for record in truth:
        answered = _on_bins(record, cells)
        found += sum(np.minimum(shares, answered[branch] / total).sum() for branch, shares in record["share"].items())
    return float(found)


def _on_bins(record, cells):
    """Shares of the answer on the true bins of one record, by branch."""
    edges = np.array(record["edges_Nm"])
    out = {branch: np.zeros(edges.size - 1) for branch in record["share"]}
    for cell in cells:
        if cell["record"] == record["record"] and cell["branch"] in out:
            out[cell["branch"]] += max(float(cell["share"]), 0.0) * _spread(edges, cell)
    return out


def _spread(edges, cell):
    """Part of a cell's torque range in each bin of |torque|; what lies beyond the last edge counts to the last bin."""
    low, high = sorted((abs(float(cell["torque_lo_Nm"])), abs(float(cell["torque_hi_Nm"]))))
    inner = np.clip((edges[1:-1] - low) / max(high - low, 1e-12), 0.0, 1.0)
    return np.diff(np.r_[0.0, inner, 1.0])
