"""What acts on the reducer unread: nothing where nothing is drawn, and what the mechanics themselves make of it."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.channel_noise import draw_noise
from backdrive_bayes.bench.plan import Loop, make_path
from backdrive_bayes.bench.protocol import Circumstances
from backdrive_bayes.bench.rig import Rig, draw_rig, rig_angle
from backdrive_bayes.bench.sliders import MECHANICS
from backdrive_bayes.bench.sliders.unlisted.torque_channel import UnseenTorqueRipple

QUIET = Rig(0.0, 1.0, 0.0, 0.0, 0.1, 0.0, 1.0, 0.0, 5.0)


def record(seed=0):
    rng = np.random.default_rng(seed)
    reducer = MECHANICS.draw_reducer(rng)
    where = Circumstances(make_path(Loop(1.0, 0.5), reducer.rated_torque_nm, (0.8,)), 3.0)
    time = np.linspace(0.0, where.path.end_s, 10001)
    return reducer, where, time, MECHANICS.angle(reducer, (), where, time)


def added(rig, seed=0, rng_seed=0):
    reducer, where, time, own = record(seed)
    return rig_angle(np.random.default_rng(rng_seed), rig, reducer, where, time, own)


def test_a_rig_without_faults_adds_nothing():
    assert np.abs(added(replace(QUIET, crossing_distance_nm=0.01))).max() < 1e-12


@pytest.mark.parametrize("seed", range(3))
def test_an_unread_torque_acts_as_if_the_mechanics_felt_it(seed):
    reducer, where, time, own = record(seed)
    strength = 2e-3
    felt = MECHANICS.angle(reducer, (UnseenTorqueRipple(strength, 0.7, 0.0),), where, time) - own
    rig = replace(QUIET, ripple_nm=strength * reducer.rated_torque_nm, ripple_hz=0.7, crossing_distance_nm=1.0)
    size = np.abs(felt).max()
    assert np.quantile(np.abs(added(rig, seed) - felt), 0.9) < 0.1 * size


def test_the_cable_holds_back_in_either_direction():
    reducer, where, time, own = record()
    quiet = replace(QUIET, crossing_distance_nm=1.0)
    stiff = added(replace(quiet, cable_nm=1e-3 * reducer.rated_torque_nm))
    assert np.corrcoef(stiff, own)[0, 1] < -0.5
    rubbed = added(replace(quiet, cable_friction_nm=1e-3 * reducer.rated_torque_nm))
    rising = np.gradient(where.path.torque_at(time)) > 0
    assert rubbed[rising].mean() < 0 < rubbed[~rising].mean()


def test_crossing_torques_differ_from_time_to_time():
    rig = replace(QUIET, crossing_nm=1e-3, crossing_distance_nm=0.01)
    first, again, other = added(rig), added(rig), added(rig, rng_seed=1)
    np.testing.assert_array_equal(first, again)
    assert np.std(first) > 0 and np.std(first - other) > np.std(first)


def test_all_that_a_rig_adds_stays_below_the_noise():
    for seed in range(6):
        reducer, where, time, own = record(seed)
        rng = np.random.default_rng(seed)
        noise = draw_noise(rng, reducer)
        sd = noise.total_rad(np.gradient(own, time) / where.path.rate_nm_per_s)
        extra = rig_angle(rng, draw_rig(rng, reducer, noise, 1.0), reducer, where, time, own)
        assert np.std(extra / sd) < 0.35
