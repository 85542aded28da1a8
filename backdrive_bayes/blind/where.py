"""Where the gap of a bench unit truly lies: shares over record × branch × torque bin; and how much an answer overlaps with it."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.bench.truth import BenchUnit

BINS = 5
BRANCHES = ("load+", "unload+", "load-", "unload-")


def true_map(bench: BenchUnit, curve: str) -> list[dict] | None:
    """Shares of one curve of the truth ('remainder_rad' or 'effect_rad'), None where it vanishes.

    One object a record: ``record``, ``edges_Nm`` (BINS + 1,) of |torque| from 0 to the largest, and ``share``, a list of BINS for
    each branch. A share is that of the curve's square integrated over the torque travelled, so that a slow record with many
    samples counts no more than a fast one. All shares sum to one.
    """
    energies = [_energy(truth.torque_nm, getattr(truth, curve)) for truth in bench.truth.records]
    total = sum(energy.sum() for _, energy in energies)
    if total <= 0.0:
        return None
    return [
        {
            "record": record.name,
            "edges_Nm": [rounded(v) for v in edges],
            "share": {name: [rounded(v) for v in row] for name, row in zip(BRANCHES, energy / total, strict=True)},
        }
        for record, (edges, energy) in zip(bench.unit.records, energies, strict=True)
    ]


def rounded(value) -> float:
    """Few enough digits that the last bits of arithmetic do not show."""
    return float(f"{value:.5g}")


def branch_index(torque_nm: np.ndarray) -> np.ndarray:
    """Position in ``BRANCHES`` of every sample of a noise-free torque history, shape (samples,)."""
    rising, positive = np.gradient(torque_nm) > 0, torque_nm > 0
    return np.where(positive, np.where(rising, 0, 1), np.where(rising, 3, 2))


def _energy(torque, values):
    """Edges (BINS + 1,) [N·m] and integrated squares (branches, BINS) [rad²·N·m]."""
    edges = np.linspace(0.0, np.abs(torque).max(), BINS + 1)
    cell = np.clip(np.searchsorted(edges, np.abs(torque), side="right") - 1, 0, BINS - 1)
    weight = values**2 * np.abs(np.gradient(torque))
    energy = np.bincount(branch_index(torque) * BINS + cell, weight, len(BRANCHES) * BINS)
    return edges, energy.reshape(len(BRANCHES), BINS)


def overlap(truth: list[dict] | None, cells) -> float | None:
    """Overlap from 0 to 1 of a true map and the cells of where.map; None where either is empty.

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
