"""Effects of the engine bench: absent at strength 0, growing with it, and each with its signature."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the engine bench needs the extra 'bench'")

from backdrive_bayes.bench.engine import MECHANICS  # noqa: E402
from backdrive_bayes.bench.engine import channel_effects as channel  # noqa: E402
from backdrive_bayes.bench.engine import series_effects as series  # noqa: E402
from backdrive_bayes.bench.engine import train_effects as train  # noqa: E402
from backdrive_bayes.bench.plan import Loop, make_path  # noqa: E402
from backdrive_bayes.bench.protocol import Circumstances  # noqa: E402

ALL = {**MECHANICS.effects, **MECHANICS.unlisted}
REDUCER = MECHANICS.draw_reducer(np.random.default_rng(2), "strain_wave")
MESHED = MECHANICS.draw_reducer(np.random.default_rng(4), "planetary")
SAMPLES = 2001


def difference(effect, rate=0.5, start_s=100.0, index=1, reducer=REDUCER):
    """Load over T_r and what the effect adds, over the angle scale; the settled loop's samples are the last four fifths."""
    where = Circumstances(make_path(Loop(1.0, rate), reducer.rated_torque_nm, ()), start_s, index)
    time = np.linspace(0.0, where.path.end_s, SAMPLES)
    change = MECHANICS.angle(reducer, (effect,), where, time) - MECHANICS.angle(reducer, (), where, time)
    return where.path.torque_at(time) / reducer.rated_torque_nm, change / reducer.angle_rad


def width(load, change):
    """Half the mean width that the effect adds to the settled loop."""
    rising = np.gradient(load) > 0
    settled = np.arange(load.size) > load.size // 5
    return 0.5 * (np.mean(change[settled & ~rising]) - np.mean(change[settled & rising]))


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("reducer", [REDUCER, MESHED], ids=["strain_wave", "planetary"])
def test_absent_at_strength_0_and_growing_with_it(name, reducer):
    for seed in (1, 2):
        effect = ALL[name](np.random.default_rng(seed), reducer)
        assert effect.strength == 0.0 and effect.parameters()["strength"] == 0.0
        assert not difference(effect, reducer=reducer)[1].any()
    sizes = []
    for share in (0.1, 0.3, 1.0):
        change = difference(replace(effect, strength=share * min(effect.guess, effect.most)), reducer=reducer)[1]
        assert np.all(np.isfinite(change))
        sizes.append(np.sqrt(np.mean(change**2)))
    assert 0.0 < sizes[0] < sizes[1] < sizes[2]


def test_effects_of_the_channel_leave_the_reducer_alone():
    apart = {name for name, draw in MECHANICS.effects.items() if not draw(np.random.default_rng(1), REDUCER).of_reducer}
    assert apart == {"sensor_lag", "thermal_drift", "torque_offset", "encoder_error"}


def test_the_interface_slips_only_above_its_threshold_and_stays():
    load, change = difference(series.InterfaceSlip(strength=0.1, thresholds=(0.8,)))
    fifth = SAMPLES // 5
    assert np.abs(change[:fifth][load[:fifth] < 0.78]).max() < 1e-3
    assert change[fifth] == pytest.approx(0.1, rel=0.05)
    unloading = slice(fifth, 2 * fifth)
    assert np.ptp(change[unloading]) < 5e-3


def test_creep_turns_further_at_a_slower_rate():
    effect = series.ViscoelasticCreep(strength=0.1, relaxation_s=(3.0,))
    peaks = [difference(effect, rate)[1][SAMPLES // 5] for rate in (0.1, 0.5, 2.0)]
    assert peaks[0] > 1.5 * peaks[1] > 2.0 * peaks[2] > 0.0


@pytest.mark.parametrize("relaxation_s", [1.0, 5.0])
def test_creep_follows_its_linear_equation(relaxation_s):
    effect, rate = series.ViscoelasticCreep(strength=0.1, relaxation_s=(relaxation_s,)), 0.5
    load, change = difference(effect, rate)
    first = slice(0, SAMPLES // 5)
    delayed = load[first] - rate * relaxation_s * (1.0 - np.exp(-load[first] / (rate * relaxation_s)))
    assert np.abs(change[first] / 0.1 - delayed).max() < 0.01


@pytest.mark.parametrize("in_train", [True, False])
def test_unlike_flanks_are_even_in_the_torque(in_train):
    load, change = difference(train.AsymmetricStiffness(strength=0.2, in_train=in_train), reducer=MESHED)
    up = np.interp(0.8, load[: SAMPLES // 5], change[: SAMPLES // 5])
    down = np.interp(0.8, -load[2 * SAMPLES // 5 : 3 * SAMPLES // 5], change[2 * SAMPLES // 5 : 3 * SAMPLES // 5])
    shift = 0.5 * (up + down) - change[0]
    assert abs(shift) > 5e-3
    if in_train:
        assert up * down > 0.0


def test_a_second_clearance_steps_at_its_own_drag():
    load, change = difference(series.SecondBacklash(strength=0.1, drag=0.4, crossing=0.02))
    first = slice(0, SAMPLES // 5)
    assert np.abs(change[first][load[first] < 0.39]).max() < 5e-3
    assert change[first][load[first] > 0.5].min() > 0.095


def test_lag_widens_with_the_rate():
    for kind in ("delay", "first_order", "two_pole"):
        effect = channel.SensorLag(strength=0.02, kind=kind)
        slow, fast = (width(*difference(effect, rate)) for rate in (0.1, 1.0))
        assert fast > 5.0 * slow > 0.0


def test_drift_goes_on_with_the_bench_time_and_knows_no_torque():
    effect = channel.ThermalDrift(strength=0.1, kind="linear", period_s=50.0)
    early, late = (difference(effect, start_s=start)[1] for start in (0.0, 50.0))
    assert np.allclose(late - early, 0.1)
    assert np.allclose(np.diff(early, 2), 0.0, atol=1e-9)


def test_an_offset_shifts_the_loop_along_the_torque():
    where = Circumstances(make_path(Loop(1.0, 0.5), REDUCER.rated_torque_nm, ()))
    time = np.linspace(0.0, where.path.end_s, SAMPLES)
    load, plain = where.path.torque_at(time), MECHANICS.angle(REDUCER, (), where, time) / REDUCER.angle_rad
    shifted = plain + difference(channel.TorqueOffset(strength=0.03))[1]
    rising = slice(3 * SAMPLES // 5 + 5, SAMPLES)
    expected = np.interp(load[rising] + 0.03 * REDUCER.rated_torque_nm, load[rising], plain[rising])
    inside = np.abs(load[rising]) < 0.5 * REDUCER.rated_torque_nm
    assert np.abs(shifted[rising] - expected)[inside].max() < 0.01


def test_an_encoder_errs_periodically_in_its_angle():
    effect = channel.EncoderError(strength=0.01, period=0.3)
    where = Circumstances(make_path(Loop(1.0, 0.5), REDUCER.rated_torque_nm, ()), 100.0, 1)
    plain = MECHANICS.angle(REDUCER, (), where, np.linspace(0.0, where.path.end_s, SAMPLES)) / REDUCER.angle_rad
    assert np.allclose(difference(effect)[1], 0.01 * np.sin(2.0 * np.pi * plain / 0.3))


def test_bearings_that_stick_let_go_in_small_jumps():
    change = difference(train.StickSlip(strength=0.5))[1]
    steps = np.abs(np.diff(change))
    assert steps.max() > 5.0 * np.median(steps[steps > 0])
    assert np.count_nonzero(np.diff(np.sign(np.diff(change[-SAMPLES // 5 :])))) > 20


@pytest.mark.parametrize("law,direction", [("log", 1.0), ("log", -1.0), ("stribeck", -1.0), ("viscous", 1.0)])
def test_friction_changes_with_the_rate(law, direction):
    effect = train.RateDependentFriction(strength=0.3, law=law, direction=direction)
    slow, fast = (width(*difference(effect, rate)) for rate in (0.1, 1.0))
    assert direction * (fast - slow) > 1e-3


def test_members_bring_back_what_a_reducer_lacks():
    lacking = MECHANICS.draw_reducer(np.random.default_rng(2), "strain_wave", ("load_dependent_friction", "hardening_stiffness"))
    rng = np.random.default_rng(1)
    loaded = replace(MECHANICS.effects["load_dependent_friction"](rng, lacking), strength=0.1)
    load, change = difference(loaded, reducer=lacking)
    far = np.abs(load) > 0.4
    assert width(load[far], change[far]) > 1e-3
    hard = replace(MECHANICS.effects["hardening_stiffness"](rng, lacking), strength=0.3)
    assert np.ptp(difference(hard, reducer=lacking)[1]) > 0.02
