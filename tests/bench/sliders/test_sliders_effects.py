"""Every effect of the virtual bench: absent at strength 0, and found where its signature says."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.plan import Loop, make_path
from backdrive_bayes.bench.protocol import Circumstances
from backdrive_bayes.bench.sliders import MECHANICS
from backdrive_bayes.bench.sliders.effect import Effect
from backdrive_bayes.bench.sliders.reducer import KINDS, draw_reducer
from backdrive_bayes.bench.sliders.registry import EFFECTS, UNLISTED

NAMES = [*EFFECTS, *UNLISTED]
STEP_S = 0.002


def setting(rate=0.5, cycles=1, index=0, past=(), start_s=0.0, reducer=None):
    return Circumstances(make_path(Loop(1.0, rate, cycles), reducer.rated_torque_nm, past), start_s, index)


def times(at, step_s=STEP_S):
    return np.arange(int(round(at.path.end_s / step_s)) + 1) * step_s


def record_angle(reducer, effects, at, step_s=STEP_S):
    return MECHANICS.angle(reducer, effects, at, times(at, step_s))


def drawn(name, seed=0, kind="intermediate"):
    rng = np.random.default_rng(seed)
    reducer = draw_reducer(rng, kind)
    return reducer, {**EFFECTS, **UNLISTED}[name](rng, reducer)


def change(name, strength, seed=0, make=lambda effect: effect, **where):
    """Torque [T_r], time and change of the angle [half angles] on one record."""
    reducer, effect = drawn(name, seed)
    at = setting(reducer=reducer, **where)
    plain = record_angle(reducer, (), at)
    changed = record_angle(reducer, (make(replace(effect, strength=strength)),), at)
    time = times(at)
    return at.path.torque_at(time) / reducer.rated_torque_nm, time, (changed - plain) / reducer.angle_rad


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(3))
def test_an_effect_of_no_strength_is_absent(name, seed):
    _, _, off = change(name, 0.0, seed)
    assert np.abs(off).max() < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_an_effect_grows_with_its_strength(name):
    _, effect = drawn(name)
    sizes = [np.std(change(name, s * effect.guess, index=1, start_s=50.0)[2]) for s in (0.3, 1.0, 3.0)]
    assert 0 < sizes[0] < sizes[1] < sizes[2]


def test_slip_moves_above_its_threshold_while_loading_only():
    _, effect = drawn("interface_slip")
    torque, _, off = change("interface_slip", 0.1, make=lambda effect: replace(effect, springs_back=False))
    moved = np.abs(np.diff(off)) > 1e-9
    loading = np.diff(np.abs(torque)) > 0
    assert moved.any() and not (moved & ~loading).any()
    assert np.abs(torque[:-1][moved]).min() > effect.threshold - effect.patches_spread - 0.02


def test_slip_that_springs_back_begins_when_the_load_has_fallen_by_twice_its_threshold():
    _, effect = drawn("interface_slip")
    torque, _, off = change("interface_slip", 0.1, make=lambda effect: replace(effect, springs_back=True))
    falling = (np.diff(torque) < 0) & (np.arange(torque.size - 1) > np.argmax(torque))
    begun = torque[:-1][falling & (np.diff(off) < -1e-9)]
    assert abs(begun.max() - (1 - 2 * effect.threshold)) < 2 * effect.patches_spread + 0.03


def test_creep_goes_on_longer_in_a_slower_record():
    slow, fast = (np.ptp(change("viscoelastic_creep", 0.1, rate=r)[2]) for r in (0.05, 5.0))
    assert slow > 2 * fast


def test_asymmetry_lies_on_one_flank():
    torque, _, off = change("asymmetric_stiffness", 0.1)
    sides = np.abs(off[torque > 0.6]).max(), np.abs(off[torque < -0.6]).max()
    assert max(sides) > 10 * min(sides)


def test_second_backlash_is_a_step_at_its_own_torque():
    _, effect = drawn("second_backlash")
    torque, _, off = change("second_backlash", 0.1)
    rising = slice(3 * off.size // 5, None)
    steep = torque[rising][np.argmax(np.gradient(off[rising]))]
    assert steep == pytest.approx(effect.drag, abs=0.1)


def test_lag_widens_the_loop_in_proportion_to_the_rate():
    # Where the branches are straight the reading is late by lag · rate · slope.
    def width(rate):
        torque, _, off = change("sensor_lag", 0.02, rate=rate, make=lambda e: replace(e, delay_share=1.0))
        up, down = 3 * off.size // 5, off.size // 5
        middle = np.abs(torque - 0.6) < 0.02
        index = np.arange(off.size)
        return off[middle & (index > down) & (index < up)].mean() - off[middle & (index > up)].mean()

    assert width(1.0) / width(0.1) == pytest.approx(10, rel=0.1)


@pytest.mark.parametrize("seed", range(6))
def test_drift_depends_on_time_not_on_torque(seed):
    _, time, off = change("thermal_drift", 0.1, seed, start_s=20.0)
    _, other_time, other = change("thermal_drift", 0.1, seed, start_s=20.0, rate=0.25)
    shared = time < 3
    np.testing.assert_allclose(off[shared], np.interp(time[shared], other_time, other), atol=1e-9)


def test_torque_offset_shifts_the_loop_along_torque():
    reducer, effect = drawn("torque_offset")
    at, effect = setting(reducer=reducer, cycles=2), replace(effect, strength=0.02, factors=(1.0,))
    torque = at.path.torque_at(times(at))
    plain, shifted = (record_angle(reducer, e, at) for e in ((), (effect,)))
    last = slice(8 * torque.size // 9, None)  # 0 → +T of the last cycle, steep where the clearance is crossed
    half = 0.5 * (plain[last][0] + plain[last][-1])
    move = np.interp(half, shifted[last], torque[last]) - np.interp(half, plain[last], torque[last])
    assert move == pytest.approx(0.02 * effect.direction * reducer.rated_torque_nm, rel=0.1)


def test_encoder_error_depends_on_the_angle_alone():
    reducer, effect = drawn("encoder_error")
    at = setting(reducer=reducer)
    plain = record_angle(reducer, (), at)
    off = record_angle(reducer, (replace(effect, strength=0.3),), at) - plain
    order = np.argsort(plain)
    assert np.abs(np.diff(off[order])).max() < 0.4 * np.diff(plain[order]).max() + 1e-9


def test_stick_slip_holds_and_jumps():
    _, _, off = change("stick_slip", 0.05, make=lambda e: replace(e, variant="everywhere"))
    steps = np.abs(np.diff(off))
    assert steps.max() > 20 * np.median(steps)


@pytest.mark.parametrize("seed", range(4))
def test_rate_dependent_friction_changes_the_width_without_time(seed):
    """A loop at the reference rate is left alone where the law says so; far from it the width changes."""
    reducer, effect = drawn("rate_dependent_friction", seed)
    effect = replace(effect, law="log", reference=0.5, strength=0.5)
    widths = []
    for rate in (0.05, 0.5, 5.0):
        at = setting(reducer=reducer, rate=rate)
        step = at.path.end_s / 5000
        off = record_angle(reducer, (effect,), at, step) - record_angle(reducer, (), at, step)
        widths.append(np.mean(off[1000:3000]) - np.mean(off[3000:]))
    assert abs(widths[1]) < 1e-12
    assert np.sign(widths[2]) == -np.sign(widths[0]) == effect.direction


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_the_reducer_closes_its_tips_and_dissipates(kind, seed):
    reducer = draw_reducer(np.random.default_rng(seed), kind)
    at = setting(reducer=reducer, cycles=2)
    torque = at.path.torque_at(times(at))
    angle = record_angle(reducer, (), at)
    n = torque.size // 9
    np.testing.assert_allclose(angle[5 * n], angle[9 * n], atol=1e-9 * reducer.angle_rad)
    cycle = slice(5 * n, 9 * n + 1)
    assert np.sum(0.5 * (torque[cycle][1:] + torque[cycle][:-1]) * np.diff(angle[cycle])) > 0


@pytest.mark.parametrize("name", ["interface_slip", "second_backlash", "viscoelastic_creep", "stick_slip"])
@pytest.mark.parametrize("seed", range(4))
def test_passive_elements_take_energy(name, seed):
    reducer, effect = drawn(name, seed)
    at = setting(reducer=reducer, cycles=2)
    torque = at.path.torque_at(times(at))
    angle = record_angle(reducer, (replace(effect, strength=effect.guess),), at)
    n = torque.size // 9
    cycle = slice(5 * n, 9 * n + 1)
    assert np.sum(0.5 * (torque[cycle][1:] + torque[cycle][:-1]) * np.diff(angle[cycle])) > 0


def test_every_effect_is_final_and_acts_somewhere():
    hooks = ("torque", "friction", "floating_drag", "transmit", "deflect", "read")
    for name in NAMES:
        kind = type(drawn(name)[1])
        assert kind.__mro__[1] is Effect
        assert any(hook in vars(kind) for hook in hooks), name


@pytest.mark.parametrize("name", [None, "sensor_lag", "encoder_error", "buffer_slip", "drive_crosstalk"])
def test_the_angle_at_a_time_does_not_depend_on_other_times(name):
    reducer, effect = drawn(name or "sensor_lag")
    effects = (replace(effect, strength=0.5 * effect.guess),) if name else ()
    at = setting(reducer=reducer, past=(0.9, -0.7))
    fine = record_angle(reducer, effects, at)
    np.testing.assert_allclose(MECHANICS.angle(reducer, effects, at, times(at)[::40]), fine[::40], atol=1e-4 * reducer.angle_rad)


def test_turned_reducers_are_physical_and_each_is_another():
    reducer = draw_reducer(np.random.default_rng(1), "intermediate")
    at = setting(reducer=reducer)
    plain = record_angle(reducer, (), at)
    changes = [record_angle(other, (), at) - plain for other in reducer.turned()]
    assert all(0 < np.abs(change).max() < 0.1 * reducer.angle_rad for change in changes)
    assert len(reducer.turned(("hardening_stiffness",))) == len(changes) - 1
