"""Slow wander of the reading is found where it is, at about its size and time, and not where it is not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from backdrive_bayes.bench.known_truth import BenchNoise, angle_noise, physical_reducer, simulate_unit
from backdrive_bayes.engine import linearise as engine
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.engine.search import Search
from backdrive_bayes.engine.wander import learn_wander
from backdrive_bayes.gap.hypotheses import weigh
from backdrive_bayes.mechanics.effect import Distortion
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import library_terms
from backdrive_bayes.records.unit_folder import read_unit

SIZE, TIME = 1e-4, 0.1
"""Of the planted wander: its standard deviation [rad], and its correlation time in shares of a leg."""


def wandering(size: float, time: float = TIME, seed: int = 3):
    """A clean reducer whose reading wanders in each of two records."""
    rng = np.random.default_rng(seed)
    unit, records = simulate_unit(physical_reducer(rng), ((0.1, 0.01), (0.1, 0.02)), BenchNoise(), rng, 100.0), []
    for r in unit.records:
        slow = BenchNoise(0.0, size, time * r.time_s[-1] / 2.5, 0.0)
        records.append(replace(r, angle_rad=r.angle_rad + angle_noise(r.time_s.size, r.time_s[1] - r.time_s[0], slow, rng)))
    return reduce_unit(replace(unit, records=tuple(records)), 120)


def learnt(size: float):
    """The unit, with what was learnt and the gain."""
    reduced = wandering(size)
    return learn_wander(Search(reduced, library_terms(), BASELINE).learn(Distortion()))


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


def test_the_order_of_the_records_decides_nothing():
    """The planted fault learns them in turn: the first of those that a wander of one could explain has it."""
    unit, found = read_unit(Path(__file__).parents[2] / "data" / "reducer-2"), []
    for order in ((0, 1, 2, 3), (3, 1, 2, 0)):
        reduced = reduce_unit(replace(unit, records=tuple(unit.records[k] for k in order)))
        learnt, gain = learn_wander(Search(reduced, library_terms(), BASELINE).first(Distortion()))
        found.append({b.name: n.wander_rad for b, n in zip(learnt.blocks, learnt.noise, strict=True)} | {"gain": gain})
    assert found[0] == pytest.approx(found[1], rel=1e-5) and found[0]["gain"] > 10


def test_a_wander_is_no_drift(monkeypatch):
    """The planted fault learns it only where a drift acts, which stands for it."""
    reduced = wandering(5e-5, 0.3, 4)

    def factors():
        found = weigh(engine.linearise(reduced, library_terms())).log_factor
        return found[("thermal_drift",)], found[("viscoelastic_creep",)]

    assert max(factors()) < 3.0
    monkeypatch.setattr(engine, "_calm", lambda linear: linear)
    assert min(factors()) > 5.0
