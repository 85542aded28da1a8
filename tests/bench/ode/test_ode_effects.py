"""Effects of the bench "ode": absent at strength 0, growing with it, and found where their signature says."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.ode import MECHANICS
from backdrive_bayes.bench.ode.effects import channel, clamp, compliance, friction, second_backlash, stick_slip
from backdrive_bayes.bench.plan import Loop, make_path
from backdrive_bayes.bench.protocol import Circumstances

DRAWS = {**MECHANICS.effects, **MECHANICS.unlisted}
CHANNEL = {"sensor_lag", "thermal_drift", "torque_offset", "encoder_error"}


def a_reducer(kind="cycloidal", seed=0, without=()):
    return MECHANICS.draw_reducer(np.random.default_rng(seed), kind, without)


def change(reducer, effect, rate=0.5, samples=2001, **where):
    """Time, torque over T_r and what the effect changes in the angle, in angle scales."""
    at = Circumstances(make_path(Loop(1.0, rate, 1), reducer.rated_torque_nm, ()), **where)
    time = np.linspace(0.0, at.path.end_s, samples)
    moved = MECHANICS.angle(reducer, (effect,), at, time) - MECHANICS.angle(reducer, (), at, time)
    return time, at.path.torque_at(time) / reducer.rated_torque_nm, moved / reducer.angle_rad


def legs(time):
    """Which samples lie on the first loading, the settled fall and the settled rise."""
    end = time[-1] / 5.0
    return time <= end, (time >= end) & (time <= 3 * end), time >= 3 * end


@pytest.mark.parametrize("name", DRAWS)
def test_no_strength_is_absent_and_more_is_more(name):
    without = tuple({name} & {"load_dependent_friction", "hardening_stiffness"})
    for seed in range(2):
        rng = np.random.default_rng(seed)
        reducer = MECHANICS.draw_reducer(rng, None, without)
        effect = DRAWS[name](rng, reducer)
        assert effect.strength == 0.0
        assert not change(reducer, effect, index=1)[2].any()
        top = min(3.0 * effect.guess, effect.most)
        moved = [change(reducer, replace(effect, strength=s * top), index=1, start_s=30.0)[2] for s in (1e-5, 0.3, 1.0)]
        sizes = [np.std(m) for m in moved]
        assert np.isfinite(moved).all()
        assert sizes[0] < 0.02 * sizes[2] and sizes[1] < sizes[2]


def test_effects_are_drawn_alike_and_told_as_json():
    for name, draw in DRAWS.items():
        first, again = (draw(np.random.default_rng(5), a_reducer()) for _ in range(2))
        assert first == again and first.parameters()["strength"] == 0.0
        if name in MECHANICS.effects:
            assert first.of_reducer == (name not in CHANNEL)


def test_the_clamp_slips_near_full_load_and_keeps_its_slip():
    time, load, slip = change(a_reducer(), clamp.DahlClamp(0.05, 1.1, 3.0))
    first, fall, _ = legs(time)
    assert slip[first][load[first] < 0.5].max() < 0.002
    assert slip[first].max() == pytest.approx(0.05, abs=1e-3)
    assert np.ptp(slip[fall & (load > 0.0)]) < 1e-4


def test_a_backed_clamp_slips_beyond_what_it_holds():
    time, load, slip = change(a_reducer(), clamp.BackedClamp(0.05, 0.7, 0.02))
    first = legs(time)[0]
    assert np.abs(slip[first & (load < 0.65)]).max() < 0.005
    assert slip[first].max() == pytest.approx(0.05, rel=0.05)


def test_creep_depends_on_the_rate():
    effect = compliance.ViscoelasticCreep(0.1, (3.0,), (1.0,))
    peaks = [change(a_reducer(), effect, rate)[2].max() for rate in (0.1, 0.5, 1.0)]
    assert peaks[0] > 1.5 * peaks[1] > 1.5 * peaks[2] > 0


def test_asymmetry_acts_on_one_side():
    _, load, moved = change(a_reducer(), compliance.AsymmetricStiffness(0.1, 1.0, "flank", 0.3, 2))
    assert moved[load > 0.9].min() > 0.05
    assert np.abs(moved[load < -0.3]).max() < 0.01


def test_a_second_clearance_is_crossed_at_its_own_torque():
    reducer, effect = a_reducer(), second_backlash.SecondBacklash(0.1, 0.4, 0.02, 1.5, 0.2, 0.03)
    time, load, moved = change(reducer, effect)
    rise = legs(time)[2]
    assert moved[rise & (load < 0.3)].max() < 0.0
    assert moved[rise & (load > 0.5)].min() > 0.04


@pytest.mark.parametrize("variant", ["delay", "one pole", "two poles"])
def test_lag_is_the_slope_times_the_time(variant):
    reducer = a_reducer("strain_wave", without=("hardening_stiffness",))
    time, load, moved = change(reducer, channel.SensorLag(0.05, variant, 0.6), rate=0.5)
    at = Circumstances(make_path(Loop(1.0, 0.5, 1), reducer.rated_torque_nm, ()))
    slope = np.gradient(MECHANICS.angle(reducer, (), at, time), time) / reducer.angle_rad
    steady = legs(time)[0] & (load > 0.5) & (load < 0.95)
    assert np.allclose(moved[steady], -0.05 * slope[steady], rtol=0.05)


def test_drift_goes_on_from_record_to_record():
    effect = channel.ThermalDrift(0.1, "line", 1.0, 60.0)
    early, late = (change(a_reducer(), effect, start_s=start)[2] for start in (0.0, 60.0))
    assert np.allclose(late - early, 0.1) and early[-1] == pytest.approx(0.1 / 6.0)


def test_a_torque_offset_shifts_the_loop_along_the_torque():
    reducer = a_reducer("strain_wave")
    at = Circumstances(make_path(Loop(1.0, 0.5, 2), reducer.rated_torque_nm, ()))
    end = at.path.end_s
    rise = np.linspace(end - 3.6, end - 0.4, 400)
    shifted = MECHANICS.angle(reducer, (channel.TorqueOffset(0.03, 1.0),), at, rise)
    plain = MECHANICS.angle(reducer, (), at, rise + 0.03 / 0.5)
    assert np.abs(shifted - plain).max() < 0.01 * reducer.angle_rad


@pytest.mark.parametrize("variant", ["signals", "triangle", "harmonics"])
def test_the_encoder_error_is_periodic_in_the_angle(variant):
    reducer, effect = a_reducer(), channel.EncoderError(0.4, variant, 0.2, 1.0, 0.3)
    angle = np.linspace(-0.5, 0.5, 300)
    error, later = effect.read(None, None, angle) - angle, effect.read(None, None, angle + 0.2) - angle - 0.2
    assert np.allclose(error, later) and 0.2 * 0.2 < np.abs(error).max() * 2 * np.pi < 0.2
    assert np.diff(effect.read(None, None, angle)).min() > 0
    assert reducer.angle_rad > 0


def test_stick_slip_jumps_and_fades_with_the_rate_where_it_heals_slowly():
    time, _, moved = change(a_reducer(), stick_slip.StickSlip(0.03, 0.5, 0.002, 0.15, 0.1, 0.2), samples=4001)
    steps = np.diff(moved[legs(time)[2]])
    assert steps.max() > 10 * np.median(np.abs(steps))
    assert np.sum(steps > 0.003) > 30
    slow = stick_slip.StickSlip(0.03, 0.5, 0.3, 0.15, 0.0, 0.2)
    sizes = [np.std(change(a_reducer(), slow, rate)[2][1000:]) for rate in (0.1, 1.0)]
    assert sizes[0] > sizes[1]


@pytest.mark.parametrize("law", friction.LAWS)
@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_friction_follows_the_rate_either_way(law, direction):
    effect = friction.RateDependentFriction(0.3, law, direction, 0.1, 0.2, 0.5)
    widths = []
    for rate in (0.1, 0.5, 1.0):
        time, load, moved = change(a_reducer("strain_wave"), effect, rate)
        _, fall, rise = legs(time)
        middle = np.abs(load) < 0.3
        widths.append(np.mean(moved[fall & middle]) - np.mean(moved[rise & middle]))
    assert np.all(np.diff(widths) * direction > 0)


def test_friction_under_load_widens_the_loop_under_load():
    reducer = a_reducer("strain_wave", without=("load_dependent_friction",))
    time, load, moved = change(reducer, friction.LoadDependentFriction(0.1, (0.4, 0.3, 0.3), 1.0))
    _, _, rise = legs(time)
    assert np.abs(moved[rise & (load > 0.9)]).mean() > 3 * np.abs(moved[rise & (load > 0.0) & (load < 0.1)]).mean()


def test_a_jump_of_the_mount_and_debris_stay_where_they_are():
    reducer = a_reducer()
    time, _, jump = change(reducer, replace(MECHANICS.unlisted["mount_jump"](np.random.default_rng(0), reducer), strength=0.1))
    assert np.diff(jump).max() + -np.diff(jump).min() > 0.09 and jump[0] == 0.0
    effect = MECHANICS.unlisted["debris"](np.random.default_rng(0), reducer)
    _, load, moved = change(reducer, replace(effect, strength=1.0, place=0.7, width=0.04))
    assert np.abs(moved[load > 0.2]).max() > 5 * np.abs(moved[load < -0.2]).max()
