"""Slow wander of the reading is found where it is, at about its size and time, and not where it is not."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.known_truth import BenchNoise, angle_noise, physical_reducer, simulate_unit
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.engine.search import Search
from backdrive_bayes.engine.wander import learn_wander
from backdrive_bayes.mechanics.effect import Distortion
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import library_terms

SIZE, TIME = 1e-4, 0.1
"""Of the planted wander: its standard deviation [rad], and its correlation time in shares of a leg."""


def learnt(size: float):
    """The unit of a clean reducer whose reading wanders in each of two records, with what was learnt and the gain."""
    rng = np.random.default_rng(3)
    unit, records = simulate_unit(physical_reducer(rng), ((0.1, 0.01), (0.1, 0.02)), BenchNoise(), rng, 100.0), []
    for r in unit.records:
        slow = BenchNoise(0.0, size, TIME * r.time_s[-1] / 2.5, 0.0)
        records.append(replace(r, angle_rad=r.angle_rad + angle_noise(r.time_s.size, r.time_s[1] - r.time_s[0], slow, rng)))
    reduced = reduce_unit(replace(unit, records=tuple(records)), 120)
    return learn_wander(Search.over(reduced, library_terms(), BASELINE).learn(Distortion()))


def test_a_planted_wander_is_learnt_at_its_size_and_time():
    reduced, gain = learnt(SIZE)
    assert gain > 10
    for noise, blocks in zip(reduced.noise, reduced.blocks, strict=True):
        leg = (blocks.end_s[-1] - blocks.begin_s[0]) / 2.5
        assert noise.wander_rad == pytest.approx(SIZE, rel=0.7)
        assert 0.2 * TIME < noise.wander_time_s / leg < 5 * TIME


def test_a_reading_that_does_not_wander_has_none():
    reduced, gain = learnt(0.0)
    assert gain == 0.0 and all(n.wander_rad == 0.0 for n in reduced.noise)
