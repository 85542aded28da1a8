"""Clean reducers of the contact bench: odd, rate-independent, dissipative, and independent of the grid asked for."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.contact import MECHANICS
from backdrive_bayes.bench.contact.chain import Chain, contact_stiffness
from backdrive_bayes.bench.contact.effect import Test
from backdrive_bayes.bench.contact.mechanics import LOAD_STEP, run_chain
from backdrive_bayes.bench.contact.solver import STEP, follow
from backdrive_bayes.bench.plan import Loop, Path, make_path
from backdrive_bayes.bench.protocol import Circumstances

SEEDS = range(5)
WITHOUT = ("load_dependent_friction", "hardening_stiffness")


def drawn(seed):
    return MECHANICS.draw_reducer(np.random.default_rng(seed), MECHANICS.kinds[seed % len(MECHANICS.kinds)])


def record(reducer, rate=0.5, cycles=2, past=(), floating=0.3):
    return Circumstances(make_path(Loop(1.0, rate, cycles), reducer.rated_torque_nm, past), floating=floating)


def angle(reducer, where, samples=4001):
    time = np.linspace(0.0, where.path.end_s, samples)
    return MECHANICS.angle(reducer, (), where, time) / reducer.angle_rad


def settled_loop(reducer):
    """Load, rising and falling branch of the second cycle, on the solver's own steps."""
    where = record(reducer)
    run = run_chain(Test(reducer, where))
    turn = where.path.time_s
    falling, rising = (run.time_s >= turn[3]) & (run.time_s <= turn[4]), run.time_s >= turn[4]
    load = np.linspace(-1.0, 1.0, 2001)
    up = np.interp(load, run.load[rising], run.angle[rising])
    return load, up, np.interp(load, run.load[falling][::-1], run.angle[falling][::-1])


def work(load, turned, kept):
    return np.sum(0.5 * (load[kept][1:] + load[kept][:-1]) * np.diff(turned[kept]))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_settled_loop_dissipates_and_its_branches_are_monotone(seed):
    load, up, down = settled_loop(drawn(seed))
    area, absorbed = np.trapezoid(down - up, load), work(load, up, load >= 0) - work(load, down, load <= 0)
    assert 0.02 < area / absorbed < 0.95
    assert (np.diff(up) > 0).all() and (np.diff(down) > 0).all() and (down - up > -1e-3).all()
    assert abs(down[-1] - up[-1]) < 1e-3 and abs(down[0] - up[0]) < 1e-3
    assert 0.6 < 0.5 * (up[-1] - up[0]) < 1.05


@pytest.mark.parametrize("seed", SEEDS)
def test_a_mirrored_path_gives_the_mirrored_angle(seed):
    reducer = drawn(seed)
    where = record(reducer, past=(1.0, -0.7))
    mirrored = replace(where, path=replace(where.path, torque_nm=-where.path.torque_nm), floating=-where.floating)
    assert np.allclose(angle(reducer, where), -angle(reducer, mirrored), atol=1e-8)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_rate_does_not_matter(seed):
    reducer = drawn(seed)
    slow, fast = (angle(reducer, record(reducer, rate)) for rate in (0.1, 1.0))
    assert np.abs(slow - fast).max() < 1e-6


@pytest.mark.parametrize("seed", SEEDS)
def test_finer_steps_change_the_angle_little(seed):
    reducer = drawn(seed)
    test = Test(reducer, record(reducer))
    coarse, fine = run_chain(test), run_chain(test, load_step=LOAD_STEP / 4, largest_step=STEP / 4)
    off = np.interp(fine.time_s, coarse.time_s, coarse.angle) - fine.angle
    assert np.abs(off).max() < 5e-3 and np.sqrt(np.mean(off**2)) < 1e-3


def test_the_angle_at_a_time_does_not_depend_on_other_times():
    reducer = drawn(1)
    where = record(reducer)
    time = np.linspace(0.0, where.path.end_s, 9)
    many = np.unique(np.r_[time, np.linspace(0.0, where.path.end_s, 5003)])
    fine = MECHANICS.angle(reducer, (), where, many)
    assert np.array_equal(MECHANICS.angle(reducer, (), where, time), fine[np.searchsorted(many, time)])
    assert np.array_equal(fine, MECHANICS.angle(reducer, (), where, many))


def test_parts_float_where_the_circumstances_say_and_a_past_forgets_it():
    reducer = drawn(0)
    up, down = (angle(reducer, record(reducer, floating=f)) for f in (1.0, -1.0))
    assert up[0] - down[0] > 1.0 * reducer.clearance_share
    up, down = (angle(reducer, record(reducer, floating=f, past=(1.0, -1.0))) for f in (1.0, -1.0))
    assert np.abs(up - down).max() < 5e-3


def test_a_perturbed_torque_path_is_followed():
    reducer = drawn(2)
    path = record(reducer).path
    time = np.union1d(path.time_s, np.linspace(path.time_s[0], path.end_s, 500))
    rough = path.torque_at(time) + 0.004 * reducer.rated_torque_nm * np.sin(9.0 * time)
    moved = angle(reducer, Circumstances(Path(time, rough, path.rate_nm_per_s)))
    assert np.isfinite(moved).all() and 0 < np.std(moved - angle(reducer, record(reducer))) < 0.2


@pytest.mark.parametrize("seed", range(40))
def test_drawn_reducers_stay_in_their_ranges(seed):
    reducer = drawn(seed)
    assert 0.05 <= reducer.rated_torque_nm <= 1000.0 and 0.2 <= np.degrees(reducer.angle_rad) * 60 <= 360.0
    assert 0.0 <= reducer.clearance_share <= 0.8 and reducer.reduction_ratio >= 9
    assert reducer == drawn(seed)


def test_members_can_be_left_out():
    reducer = MECHANICS.draw_reducer(np.random.default_rng(4), None, WITHOUT)
    assert reducer.flank_friction == 0.0 and reducer.exponent == 1.0 and reducer.gap_scatter == 0.0
    assert len(reducer.turned(WITHOUT)) == len(reducer.turned()) - 1


def test_each_turned_parameter_moves_the_angle_a_little():
    reducer = drawn(0)
    plain = angle(reducer, record(reducer))
    moved = [np.std(angle(other, record(reducer)) - plain) for other in reducer.turned()]
    assert len(moved) >= 12 and min(moved) > 1e-7 and max(moved) < 0.05


def one_stage(mu=0.0, power=1.0):
    touch, film, powers = np.array([[0.3]]), np.array([1e-6]), np.array([power])
    stiff = contact_stiffness(touch, powers, film, np.array([0.5]))
    free = np.zeros((1, 1))
    return Chain(touch, touch, stiff, stiff, powers, powers, free + mu, free + 1e4, film, free, free, np.zeros(1))


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_one_contact_without_friction_follows_its_law(power):
    load = np.linspace(0.01, 1.0, 50)
    rows = follow(one_stage(power=power), load, load, np.zeros(1))
    assert np.allclose(rows[:, 1], 0.3 + 0.5 * rows[:, 0] ** (1.0 / power), atol=1e-4)


def test_coulomb_friction_of_a_flank_takes_its_share_of_the_load():
    path = np.r_[np.linspace(0.05, 1.0, 300), np.linspace(1.0, 0.1, 300)]
    rows = follow(one_stage(mu=0.2), np.arange(600.0), path, np.zeros(1))
    load = np.interp(rows[:, 0], np.arange(600.0), path)
    normal = 2.0 * (rows[:, 1] - 0.3)
    up, down = (rows[:, 0] > 100) & (rows[:, 0] < 299), rows[:, 0] > 450
    assert np.allclose(load[up] / normal[up], 1.2, atol=1e-2) and np.allclose(load[down] / normal[down], 0.8, atol=1e-2)
