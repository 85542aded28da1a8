"""Every effect of the contact bench: absent at strength 0, growing, and found where its signature says."""

import json
from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.contact import MECHANICS
from backdrive_bayes.bench.plan import Loop, make_path
from backdrive_bayes.bench.protocol import Circumstances

ALL = {**MECHANICS.effects, **MECHANICS.unlisted}
MEMBERS = ("load_dependent_friction", "hardening_stiffness")
CHANNEL = {"sensor_lag", "thermal_drift", "torque_offset", "encoder_error"}


def drawn(name, seed=0, kind=None, **fixed):
    rng = np.random.default_rng(seed)
    reducer = MECHANICS.draw_reducer(rng, kind, (name,) if name in MEMBERS else ())
    return reducer, replace(ALL[name](rng, reducer), **fixed)


def change(reducer, effect, rate=0.5, past=(1.0, -1.0), start_s=60.0, index=0, samples=3001):
    """Load, time and change of the angle [angle scales] on one record."""
    where = Circumstances(make_path(Loop(1.0, rate), reducer.rated_torque_nm, past), start_s, index, 0.2)
    time = np.linspace(0.0, where.path.end_s, samples)
    angles = [MECHANICS.angle(reducer, effects, where, time) for effects in ((), (effect,))]
    return where.path.torque_at(time) / reducer.rated_torque_nm, time, (angles[1] - angles[0]) / reducer.angle_rad


def strong(effect, factor=3.0):
    return replace(effect, strength=min(factor * effect.guess, effect.most))


def test_the_contract_s_names_are_all_there():
    assert len(MECHANICS.effects) == 12 and len(MECHANICS.unlisted) >= 6
    assert {name for name in CHANNEL if drawn(name)[1].of_reducer} == set()


@pytest.mark.parametrize("name", ALL)
def test_an_effect_is_absent_at_strength_0_and_grows_from_there(name):
    reducer, effect = drawn(name)
    json.dumps(effect.parameters())
    assert effect.strength == 0.0 and np.abs(change(reducer, effect)[2]).max() < 1e-12
    sizes = [np.std(change(reducer, strong(effect, s), rate=0.15, samples=1201)[2]) for s in (0.001, 0.1, 0.5, 2.0)]
    assert (np.diff(sizes) > 0).all() and sizes[0] < 0.05 * sizes[-1] + 1e-3


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("forth", [True, False])
def test_effects_act_together_in_any_order(seed, forth):
    rng = np.random.default_rng(seed)
    reducer = MECHANICS.draw_reducer(rng, None, MEMBERS)
    effects = [strong(draw(rng, reducer), 0.5) for draw in ALL.values()][:: 1 if forth else -1]
    where = Circumstances(make_path(Loop(1.0, 0.2), reducer.rated_torque_nm, (1.0,)), 30.0)
    time = np.linspace(0.0, where.path.end_s, 801)
    whole = MECHANICS.angle(reducer, tuple(effects), where, time)
    for k in range(len(effects)):
        less = MECHANICS.angle(reducer, tuple(effects[:k] + effects[k + 1 :]), where, time)
        assert np.isfinite(less).all() and np.std(whole - less) > 1e-6 * reducer.angle_rad, effects[k]


@pytest.mark.parametrize("law", ["annulus", "ring", "ratchet"])
def test_slip_begins_above_its_threshold_and_stays_until_reversed(law):
    reducer, effect = drawn("interface_slip", law=law, strength=0.05, threshold=0.7)
    load, time, slip = change(reducer, effect, past=())
    assert np.abs(slip[(time <= 2.0) & (load < 0.69)]).max() < 1e-12
    reached = slip[np.argmax(load)]
    assert reached == pytest.approx(0.05, abs=1e-3)
    assert np.allclose(slip[(time > 2.0) & (time < 4.7)], reached, atol=1e-3)


@pytest.mark.parametrize("law", ["bending", "prony", "indentation", "yield"])
def test_creep_depends_on_the_rate(law):
    reducer, effect = drawn("viscoelastic_creep", law=law, strength=0.1, constant_s=3.0, ratio=4.0, threshold=0.15)
    slow, fast = (np.ptp(change(reducer, effect, rate)[2]) for rate in (0.1, 1.0))
    assert slow > 1.5 * fast > 0


@pytest.mark.parametrize("law", ["softer", "profile", "fewer"])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_asymmetric_stiffness_changes_one_side(law, side):
    reducer, effect = drawn("asymmetric_stiffness", kind="cycloid", law=law, side=side, strength=0.2)
    load, _, off = change(reducer, effect)
    assert np.abs(off[side * load > 0.3]).max() > 5 * np.abs(off[side * load < -0.15]).max()


def test_the_second_clearance_crosses_at_its_own_torque():
    reducer, effect = drawn("second_backlash", drag=0.4, film=0.02, strength=0.2, kind="strain_wave")
    load, time, off = change(reducer, effect)
    rising = time >= time[-1] * 0.6
    crossing = np.interp(0.0, off[rising], load[rising])
    assert crossing == pytest.approx(0.4, abs=0.05) and np.ptp(off) > 0.2


@pytest.mark.parametrize("law", ["delay", "one_pole", "two_poles"])
def test_lag_grows_with_rate_and_slope(law):
    reducer, effect = drawn("sensor_lag", kind="strain_wave", law=law, strength=0.02)
    sizes = []
    for rate in (0.1, 0.5):
        load, time, off = change(reducer, effect, rate)
        steady = (load > 0.5) & (load < 0.95) & (time > 0.7 * time[-1])
        sizes.append(-np.mean(off[steady]))
    assert sizes[1] == pytest.approx(5 * sizes[0], rel=0.05)
    where = Circumstances(make_path(Loop(1.0, 0.5), reducer.rated_torque_nm, ()))
    early, late = MECHANICS.angle(reducer, (), where, np.array([9.7, 9.8])) / reducer.angle_rad
    assert sizes[1] == pytest.approx((late - early) / 0.1 * 0.02, rel=0.2)


@pytest.mark.parametrize("law", ["housing", "linear", "room"])
def test_drift_follows_the_bench_s_time_alone(law):
    reducer, effect = drawn("thermal_drift", law=law, strength=0.1)
    first, second = (change(reducer, effect, 0.5, start_s=start)[1:] for start in (60.0, 65.0))
    assert np.allclose(np.interp(first[0][first[0] > 5.0] - 5.0, *second), first[1][first[0] > 5.0], atol=1e-6)


def test_a_torque_offset_shifts_the_loop_along_the_torque():
    reducer, effect = drawn("torque_offset", kind="strain_wave", direction=1.0, retared=(0.0,), strength=0.05)
    where = Circumstances(make_path(Loop(1.0, 0.5), reducer.rated_torque_nm, (1.0, -1.0)))
    time = np.linspace(6.0, 9.8, 500)
    shifted = MECHANICS.angle(reducer, (effect,), where, time)
    ahead = MECHANICS.angle(reducer, (), where, time + 0.1)
    assert np.abs(shifted - ahead).max() < 0.02 * reducer.angle_rad
    assert np.abs(shifted - MECHANICS.angle(reducer, (), where, time)).max() > 0.03 * reducer.angle_rad


def test_the_encoder_s_error_is_periodic_in_the_angle():
    reducer, effect = drawn("encoder_error", strength=0.3, period=0.1)
    angle = np.linspace(-1.0, 1.0, 401)
    off = effect.read(None, angle, angle) - angle
    assert np.allclose(off[20:], off[:-20], atol=1e-9) and 1e-3 < np.ptp(off) < 0.05


def test_stick_slip_jumps():
    reducer, effect = drawn("stick_slip", kind="strain_wave", strength=0.04, spacing=0.04, body=0)
    off = change(reducer, effect, samples=20001)[2]
    jumps = np.abs(np.diff(off))
    assert np.sum(jumps > 10 * np.median(jumps)) > 10


@pytest.mark.parametrize("law", ["film", "stribeck", "viscous"])
def test_friction_follows_the_rate(law):
    reducer, effect = drawn("rate_dependent_friction", kind="cycloid", law=law, direction=1.0, strength=0.4)
    width = []
    for rate in (0.1, 1.0):
        load, time, off = change(reducer, effect, rate)
        middle = (np.abs(load) > 0.25) & (np.abs(load) < 0.75)
        falling = (time > 0.2 * time[-1]) & (time < 0.6 * time[-1])
        width.append(np.mean(off[middle & falling]) - np.mean(off[middle & (time > 0.6 * time[-1])]))
    assert width[1] > width[0]


@pytest.mark.parametrize("flanks", [True, False])
def test_load_dependent_friction_widens_the_loaded_loop(flanks):
    reducer, effect = drawn("load_dependent_friction", flanks=flanks, onset=0.0, strength=0.15)
    load, time, off = change(reducer, effect)
    loaded = (load > 0.3) & (load < 0.7)
    falling = (time > 0.2 * time[-1]) & (time < 0.6 * time[-1])
    assert np.mean(off[loaded & falling]) > np.mean(off[loaded & (time > 0.6 * time[-1])])


@pytest.mark.parametrize("law", ["teeth", "stop"])
def test_further_teeth_stiffen_the_loaded_reducer(law):
    reducer, effect = drawn("hardening_stiffness", law=law, strength=1.0)
    load, time, off = change(reducer, effect, past=())
    virgin = time <= 2.0
    assert np.abs(off[virgin & (load < 0.1)]).max() < 1e-9 and off[np.argmax(load)] < -0.01
    assert (np.diff(off[virgin]) < 1e-4).all()
