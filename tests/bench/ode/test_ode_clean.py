"""Clean reducers of the bench "ode": symmetric, dissipative, monotone, and the same at every rate and step."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.ode import MECHANICS
from backdrive_bayes.bench.ode.contact import Mesh, compliance_table
from backdrive_bayes.bench.plan import Loop, Path, make_path
from backdrive_bayes.bench.protocol import Circumstances

DRAWN = [MECHANICS.draw_reducer(np.random.default_rng(k), kind) for k, kind in enumerate(MECHANICS.kinds * 3)]


def circumstances(reducer, rate=0.5, past=(), cycles=1, floating=0.0):
    return Circumstances(make_path(Loop(1.0, rate, cycles), reducer.rated_torque_nm, past), 0.0, 0, floating)


def clean(reducer, where, time_s):
    return MECHANICS.angle(reducer, (), where, time_s) / reducer.angle_rad


def settled_branches(reducer, points=1501):
    """Torque over T_r and the settled ascending and descending branch on it."""
    where = circumstances(reducer, cycles=2)
    leg, end = 2.0 / 0.5, where.path.end_s
    share = np.linspace(0.0, 1.0, points)
    falling = clean(reducer, where, end - 2 * leg + share * leg)[::-1]
    return np.linspace(-1.0, 1.0, points), clean(reducer, where, end - leg + share * leg), falling


def test_draws_and_angles_are_deterministic():
    first, again = (MECHANICS.draw_reducer(np.random.default_rng(7)) for _ in range(2))
    where = circumstances(first)
    time = np.linspace(0.0, where.path.end_s, 500)
    assert first == again
    assert np.array_equal(clean(first, where, time), clean(again, where, time))


@pytest.mark.parametrize("reducer", DRAWN, ids=lambda r: r.kind)
def test_a_mirrored_path_mirrors_the_angle(reducer):
    where = circumstances(reducer, past=(0.8, -0.6), floating=0.4)
    mirrored = replace(where, path=replace(where.path, torque_nm=-where.path.torque_nm), floating=-0.4)
    time = np.linspace(0.0, where.path.end_s, 1500)
    assert np.abs(clean(reducer, where, time) + clean(reducer, mirrored, time)).max() < 1e-4


@pytest.mark.parametrize("reducer", DRAWN, ids=lambda r: r.kind)
def test_settled_loops_dissipate_and_have_monotone_branches(reducer):
    load, rising, falling = settled_branches(reducer)
    area = np.trapezoid(falling - rising, load)
    up = load >= 0
    absorbed = np.trapezoid(load[up], rising[up]) + np.trapezoid(load[~up][::-1], falling[~up][::-1])
    assert 0.02 < area / absorbed < 0.9
    assert np.diff(rising).min() > 0 and np.diff(falling).min() > 0
    assert (falling - rising).min() > -1e-5
    assert abs(falling[-1] - rising[-1]) < 5e-3
    assert 0.9 < rising[-1] < 1.1


@pytest.mark.parametrize("reducer", DRAWN, ids=lambda r: r.kind)
def test_the_rate_does_not_matter(reducer):
    slow, fast = circumstances(reducer, 0.1, (0.7,)), circumstances(reducer, 1.0, (0.7,))
    time = np.linspace(0.0, fast.path.end_s, 1500)
    assert np.abs(clean(reducer, slow, 10.0 * time) - clean(reducer, fast, time)).max() < 1e-4


@pytest.mark.parametrize("reducer", DRAWN, ids=lambda r: r.kind)
def test_finer_steps_change_little(reducer):
    where = circumstances(reducer)
    time = np.linspace(0.0, where.path.end_s, 1500)
    coarse, fine = (m.angle(reducer, (), where, time) for m in (MECHANICS, replace(MECHANICS, tolerance=5e-8)))
    assert np.abs(coarse - fine).max() < 5e-5 * reducer.angle_rad


def test_other_samples_do_not_change_the_angle():
    where = circumstances(DRAWN[0])
    time = np.linspace(0.0, where.path.end_s, 1201)
    assert np.allclose(clean(DRAWN[0], where, time), clean(DRAWN[0], where, np.repeat(time, 3))[::3], atol=1e-12)


def test_minor_loops_lie_inside_and_return_to_the_branch():
    reducer = DRAWN[2]
    turns = np.array([0.0, 1.0, -1.0, 1.0, 0.4, 0.8, 0.4, 0.8])
    time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))])
    where = Circumstances(Path(time, turns * reducer.rated_torque_nm, reducer.rated_torque_nm))
    angle = clean(reducer, where, time)
    assert angle[6] <= angle[4] + 1e-3
    assert 0.0 < angle[5] - angle[4] < angle[3] - angle[4]


def test_where_free_parts_float_is_forgotten_by_the_loop():
    reducer = MECHANICS.draw_reducer(np.random.default_rng(3), "planetary")
    one, other = (circumstances(reducer, floating=side) for side in (-1.0, 1.0))
    time = np.array([0.0, one.path.end_s])
    begin, end = clean(reducer, other, time) - clean(reducer, one, time)
    assert begin > 0.5 * reducer.clearance_share
    assert abs(end) < 1e-3


@pytest.mark.parametrize("member", ["load_dependent_friction", "hardening_stiffness"])
def test_members_can_be_left_out(member):
    reducer = MECHANICS.draw_reducer(np.random.default_rng(1), "plastic", (member,))
    if member == "load_dependent_friction":
        assert reducer.load_friction == 0.0
    else:
        torque, travel = compliance_table(reducer.meshes()[2])
        assert np.ptp(np.diff(travel) / np.diff(torque)) < 1e-9
    assert len(reducer.turned((member,))) < len(DRAWN[3].turned())


def test_turned_reducers_move_a_little():
    reducer = DRAWN[0]
    where = circumstances(reducer)
    time = np.linspace(0.0, where.path.end_s, 400)
    plain = clean(reducer, where, time)
    for other in reducer.turned():
        moved = np.std(MECHANICS.angle(other, (), where, time) / reducer.angle_rad - plain)
        assert 1e-7 < moved < 0.1


def test_compliance_is_odd_and_reaches_its_travel_at_the_rated_torque():
    torque, travel = compliance_table(Mesh(0.4, 0.01, 0.6, 1.5, 0.3, 7))
    assert np.interp(1.0, torque, travel) == pytest.approx(1.0, abs=1e-4)
    assert np.allclose(torque, -torque[::-1]) and np.allclose(travel, -travel[::-1])
    assert np.diff(torque).min() > 0 and np.diff(travel).min() > 0
