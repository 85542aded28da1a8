"""Block means of a record."""

import numpy as np
import pytest
from support.planted import planted

from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.records import reduction


def outer_counts(monkeypatch, hertz, halvings):
    """Samples of the first and last block of every leg, and how far from the peak the last block before each turn lies [N·m]."""
    monkeypatch.setattr("support.planted.HERTZ", hertz)
    monkeypatch.setattr(reduction, "HALVINGS", halvings)
    (blocks,) = reduce_unit(planted(loops=((0.1, 0.02),))).blocks
    legs = [blocks.count[blocks.leg == k] for k in range(blocks.direction.size)]
    away = 0.1 - np.abs(blocks.torque_nm[np.flatnonzero(np.diff(blocks.leg))])
    return np.array([[c[0], c[-1]] for c in legs]), away


def test_blocks_next_to_a_turning_point_are_halved(monkeypatch):
    whole, far = outer_counts(monkeypatch, 4000.0, 0)
    halved, near = outer_counts(monkeypatch, 4000.0, 3)
    assert halved == pytest.approx(whole / 8, abs=2)
    assert np.all(near < 0.2 * far)


def test_no_block_is_halved_to_less_than_few_samples(monkeypatch):
    whole, _ = outer_counts(monkeypatch, 200.0, 0)
    halved, _ = outer_counts(monkeypatch, 200.0, 3)
    assert whole.max() > 2 * reduction.FEW
    assert np.all(halved >= np.minimum(whole, reduction.FEW))
