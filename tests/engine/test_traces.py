"""How large effects may be as traces and where they act."""

import dataclasses

import numpy as np
import pytest
from support.planted import planted

from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.linearise import linearise
from backdrive_bayes.engine.periodic import wave_group
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.engine.traces import ABOVE, TRACE, sample_noise, trace_levels, usual_level, wave_trace
from backdrive_bayes.mechanics.effects.bench_hysteresis import BENCH_HYSTERESIS
from backdrive_bayes.mechanics.registry import library_terms


@pytest.fixture(scope="module")
def linear():
    return prepare(planted(3, loops=((0.1, 0.1), (0.1, 0.01))))[0]


def moved(linear, group, level):
    """Root mean square move of the angle by weights of that standard deviation, in standard deviations of a sample's noise."""
    columns = np.concatenate([group.of_record(r)[s] for r, s in enumerate(linear.reduced.settled)])
    starts = np.cumsum([0, *(s.sum() for s in linear.reduced.settled)])
    each = zip(sample_noise(linear.reduced, linear.design), linear.reduced.settled, strict=True)
    noise = np.concatenate([n[s] for n, s in each])
    for a, b in zip(starts[:-1], starts[1:], strict=True):
        columns[a:b] -= np.average(columns[a:b], axis=0, weights=noise[a:b] ** -2.0)
    weights = level * np.random.default_rng(1).normal(size=(columns.shape[1], 4000))
    return float(np.sqrt(np.mean((columns @ weights / noise[:, None]) ** 2)))


def test_every_trace_moves_the_angle_by_the_same_part_of_its_noise(linear):
    told, levels = [], trace_levels(linear.reduced, linear.design, linear.effects)
    for effect in (e for e in linear.effects if e.name in levels and e is not BENCH_HYSTERESIS):
        level = levels[effect.name]
        size = moved(linear, linear.design.group(effect.name), level)
        assert size < 1.1 * TRACE and level <= effect.present(linear.reduced.context) * (1 + 1e-9), effect.name
        told += [effect.name] if level < 0.99 * effect.present(linear.reduced.context) else []
        assert level > 0.99 * effect.present(linear.reduced.context) or size == pytest.approx(TRACE, rel=0.1), effect.name
    assert {"torque_offset", "thermal_drift", "viscoelastic_creep", "asymmetric_stiffness", "friction_rate"} <= set(told)


def test_so_does_the_trace_of_a_wave(linear):
    assert moved(linear, wave_group(linear, 9.0), wave_trace(linear)) == pytest.approx(TRACE, rel=0.1)


def test_what_acts_is_well_above_a_trace(linear):
    levels = trace_levels(linear.reduced, linear.design, linear.effects)
    for effect in (e for e in linear.effects if e.name in levels):
        usual = usual_level(effect, linear.reduced.context, levels[effect.name])
        present = effect.present(linear.reduced.context)
        assert usual == present if effect.known else usual >= max(ABOVE * levels[effect.name], present)


def test_traces_follow_the_noise(linear):
    """Twice the noise hides twice as much."""
    reduced = linear.reduced
    twice = tuple(
        dataclasses.replace(n, white_rad=2 * n.white_rad, correlated_rad=2 * n.correlated_rad, torque_nm=2 * n.torque_nm)
        for n in reduced.noise
    )
    louder = dataclasses.replace(reduced, noise=twice)
    effect = next(e for e in linear.effects if e.name == "thermal_drift")
    loud, quiet = (trace_levels(r, linear.design, [effect])[effect.name] for r in (louder, reduced))
    assert loud == pytest.approx(2 * quiet, rel=0.02)


def test_what_has_no_columns_leaves_no_trace():
    one_rate = linearise(reduce_unit(planted(3, loops=((0.1, 0.1),))), library_terms())[0]
    levels = trace_levels(one_rate.reduced, one_rate.design, one_rate.effects)
    assert "thermal_drift" in levels and "friction_rate" not in levels
