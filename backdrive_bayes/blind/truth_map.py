"""Where the gap of a bench unit truly lies: shares over record × branch × torque bin."""

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
            "edges_Nm": _rounded(edges),
            "share": {name: _rounded(row) for name, row in zip(BRANCHES, energy / total, strict=True)},
        }
        for record, (edges, energy) in zip(bench.unit.records, energies, strict=True)
    ]


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


def _rounded(values):
    return [float(f"{v:.5g}") for v in values]
