"""Clean reducers of the engine bench: symmetric, dissipative, monotone and indifferent to the rate and to the engine's clock."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the engine bench needs the extra 'bench'")

from backdrive_bayes.bench.engine import MECHANICS  # noqa: E402
from backdrive_bayes.bench.plan import Loop, Path, make_path  # noqa: E402
from backdrive_bayes.bench.protocol import Circumstances  # noqa: E402

SAMPLES = 4001
REDUCERS = [MECHANICS.draw_reducer(np.random.default_rng(seed), kind) for kind in MECHANICS.kinds for seed in (1, 2)]
each_reducer = pytest.mark.parametrize("reducer", REDUCERS, ids=[f"{r.kind}-{i % 2}" for i, r in enumerate(REDUCERS)])


def record(reducer, rate=0.5, past=(), floating=0.4, mirrored=False):
    path = make_path(Loop(1.0, rate), reducer.rated_torque_nm, past)
    if mirrored:
        return Circumstances(Path(path.time_s, -path.torque_nm, path.rate_nm_per_s), floating=-floating)
    return Circumstances(path, floating=floating)


def curve(reducer, where, mechanics=MECHANICS):
    """Load over T_r and angle over the angle scale on even samples."""
    time = np.linspace(0.0, where.path.end_s, SAMPLES)
    load = where.path.torque_at(time) / reducer.rated_torque_nm
    return load, mechanics.angle(reducer, (), where, time) / reducer.angle_rad


def loop_work(load, angle):
    """Area of the settled loop and the work absorbed on its loading quadrants."""
    load, angle = load[SAMPLES // 5 :], angle[SAMPLES // 5 :]
    middle, rise, turn = 0.5 * (load[1:] + load[:-1]), np.diff(angle), np.diff(load)
    return np.sum(middle * rise), np.sum((middle * rise)[middle * turn > 0])


@each_reducer
def test_mirrored_torque_gives_mirrored_angle(reducer):
    _, angle = curve(reducer, record(reducer, past=(0.7,)))
    _, mirrored = curve(reducer, record(reducer, past=(0.7,), mirrored=True))
    assert np.abs(angle + mirrored).max() < 1e-5


@each_reducer
def test_the_settled_loop_closes_dissipates_and_rises_with_the_torque(reducer):
    load, angle = curve(reducer, record(reducer))
    area, absorbed = loop_work(load, angle)
    assert 0.0 < area < absorbed
    assert abs(angle[SAMPLES // 5] - angle[-1]) < 1e-3
    assert np.all(np.diff(angle) * np.diff(load) > -1e-9)
    assert 0.5 < 0.5 * np.ptp(angle) < 1.2


@each_reducer
def test_the_loading_rate_makes_no_difference(reducer):
    _, slow = curve(reducer, record(reducer, 0.1))
    _, fast = curve(reducer, record(reducer, 1.0))
    assert np.abs(slow - fast).max() < 1e-6


@each_reducer
def test_a_finer_clock_changes_little(reducer):
    # A slower clock is also a slower run of the engine: neither its inertias nor its soft friction may matter.
    _, angle = curve(reducer, record(reducer))
    _, fine = curve(reducer, record(reducer), replace(MECHANICS, refine=3.0))
    assert np.sqrt(np.mean((fine - angle) ** 2)) < 2e-3


def test_same_arguments_same_angle_at_any_times():
    reducer = REDUCERS[0]
    where = record(reducer, past=(-0.8, 0.6))
    time = np.linspace(0.0, where.path.end_s, 1201)
    angle = MECHANICS.angle(reducer, (), where, time)
    assert np.array_equal(MECHANICS.angle(reducer, (), where, time), angle)
    assert np.allclose(MECHANICS.angle(reducer, (), where, time[::7]), angle[::7], rtol=0.0, atol=1e-12)


def test_where_parts_float_is_forgotten_after_the_first_peak():
    reducer = REDUCERS[0]
    load, angle = curve(reducer, record(reducer, floating=-1.0))
    _, other = curve(reducer, record(reducer, floating=1.0))
    gone = load.size // 5
    assert np.abs(angle - other)[:100].max() > 0.1 * reducer.clearance
    assert np.abs(angle - other)[gone:].max() < 1e-3


def test_a_path_that_wavers_or_waits_is_run_too():
    reducer = REDUCERS[1]
    rng, torque = np.random.default_rng(3), reducer.rated_torque_nm
    path = make_path(Loop(1.0, 0.5), torque, ())
    time = np.linspace(path.time_s[0], path.end_s, 3000)
    wavering = Path(time, path.torque_at(time) + 1e-3 * torque * rng.standard_normal(time.size), path.rate_nm_per_s)
    _, plain = curve(reducer, Circumstances(path))
    _, angle = curve(reducer, Circumstances(wavering))
    assert np.sqrt(np.mean((angle - plain) ** 2)) < 0.02
    waits = Path(np.array([0.0, 2.0, 12.0]), torque * np.array([0.0, 1.0, 1.0]), path.rate_nm_per_s)
    _, held = curve(reducer, Circumstances(waits))
    assert np.ptp(held[SAMPLES // 5 :]) < 2e-3


def test_draws_reproduce_themselves_and_leave_out_members():
    draws = [MECHANICS.draw_reducer(np.random.default_rng(5), "plastic") for _ in range(2)]
    assert draws[0] == draws[1]
    lacking = MECHANICS.draw_reducer(np.random.default_rng(5), "plastic", ("load_dependent_friction", "hardening_stiffness"))
    assert lacking.load_friction == 0.0 and lacking.stiffening == 1.0


@each_reducer
def test_every_turned_parameter_moves_the_angle(reducer):
    _, angle = curve(reducer, record(reducer))
    for turned in reducer.turned():
        _, moved = curve(turned, record(turned))
        change = moved * turned.angle_rad / reducer.angle_rad - angle
        assert 1e-6 < np.abs(change).max() < 0.4
    assert len(reducer.turned(("load_dependent_friction",))) == len(reducer.turned()) - 1
