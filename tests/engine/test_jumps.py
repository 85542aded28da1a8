"""Teeth that leap ahead are told from noise, from waves, from teeth the other way and from single steps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.engine import jumps
from backdrive_bayes.engine.jumps import (
    SEEN,
    Teeth,
    even_series,
    find_jumps,
    residual_series,
    standstill,
    weigh_teeth,
    without_wave,
)
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.engine.residuals import between_blocks
from backdrive_bayes.engine.sawtooth import FAR, STRAY, Noise, Series, _holds, fit_noise, tooth_gain
from backdrive_bayes.records.record import Record, Unit

COUNT = 2000
LEG = np.repeat([-1, 1, 2, 3], COUNT // 4)


def noise(seed=0, memory=0.8):
    rng, found = np.random.default_rng(seed), np.zeros(COUNT)
    for t in range(1, COUNT):
        found[t] = memory * found[t - 1] + np.sqrt(1 - memory**2) * rng.standard_normal()
    return found


def teeth(height, length=20.0, uneven=0.2, seed=1):
    """A lag that grows with the run and falls to nothing where it has reached a tooth's length, which varies."""
    rng, found, run, limit = np.random.default_rng(seed), np.empty(COUNT), 0.0, length
    for t in range(COUNT):
        run += 1.0
        if run > limit:
            run, limit = 0.0, length * (1 + uneven * rng.uniform(-1, 1))
        found[t] = -height * run / length
    return found


def read(values, step=0.002, trace=0.0):
    """Values as one record's residuals."""
    return [Teeth(even_series(values, LEG, 1), step, trace)]


def factor(values, **options):
    return weigh_teeth(read(values, **options)).log_factor


@pytest.mark.parametrize("length", [6.0, 20.0, 70.0])
def test_teeth_ahead_speak(length):
    assert factor(noise() + teeth(4.0, length)) > 20


@pytest.mark.parametrize("step", [0.002, 0.002029, 0.002114, 0.0031])
def test_the_shortest_teeth_are_seen_at_any_step(step):
    assert factor(noise() + teeth(4.0, 4.0), step=step) > 20


def test_noise_alone_speaks_against_them_as_far_as_they_are_seen():
    assert all(np.log(1.0 - SEEN) <= factor(noise(seed)) < -0.3 for seed in range(4))


@pytest.mark.parametrize("size", [0.85, 1.0, 1.7])
def test_a_trace_of_teeth_is_none(size):
    """A planted fault: where no bench is taken to have traces, teeth of that level in four records speak."""

    def of_records(level, trace):
        values = [noise(k, memory=0.0) + teeth(level * np.sqrt(12.0), 40.0, seed=k) for k in range(4)]
        return weigh_teeth([t for v in values for t in read(v, trace=trace)]).log_factor

    assert of_records(0.3, trace=0.3 / size) < 3.0 and of_records(0.3, trace=0.0) > 8.0
    assert of_records(1.2, trace=0.3 / size) > 5.0


def test_without_white_noise_nothing_is_a_trace():
    assert factor(noise(), trace=0.0) < 0.0 and factor(noise() + teeth(4.0), trace=0.0) > 20


def test_the_leap_is_measured():
    found = weigh_teeth(read(0.3 * noise() + teeth(4.0)))
    assert found.size_rad == pytest.approx(4.0, rel=0.4)


def test_teeth_that_leap_back_are_no_stick_slip():
    """A planted fault: the angle creeps ahead and leaps back."""
    assert factor(noise() - teeth(4.0)) < -0.6


def test_a_wave_is_no_stick_slip():
    """A planted fault: a vibration or an encoder's error as large as the noise."""
    wave = 1.5 * np.sin(2 * np.pi * np.arange(COUNT) / 20.0)
    assert factor(noise() + wave) < 2


def test_single_steps_are_no_stick_slip():
    """A planted fault: the angle steps ahead three times, by far more than the noise."""
    steps = 30.0 * np.sum(np.arange(COUNT)[:, None] > np.array([700, 1210, 1790]), axis=1)
    assert factor(noise() + steps) < 2


def test_steep_places_and_short_runs_are_left_out():
    assert even_series(noise(), np.full(COUNT, -1), 1) is None
    assert even_series(noise(), LEG, 100) is None
    assert weigh_teeth([]).log_factor == 0.0


def summed_over_runs(value, fresh, memory, sd, height, length):
    """The filter's log likelihood from its definition: every run since the last leap goes on or leaps."""
    holds, fall, found = _holds(length), height / length, 0.0
    first = np.cumprod(np.r_[1.0, holds[:-1]])
    now, runs = first / first.sum(), np.arange(holds.size)

    def density(left):
        return (1 - STRAY) * np.exp(-0.5 * (left / sd) ** 2) / sd + STRAY / FAR

    for t in range(1, value.size):
        if fresh[t]:
            now = first / first.sum()
            continue
        before = 0.5 * height - fall * runs
        rest = value[t] - memory * value[t - 1] + memory * before
        on, leap = now * holds * density(rest - (before - fall)), now * (1 - holds) * density(rest - 0.5 * height)
        now = np.r_[leap.sum(), on[:-1]]
        found += np.log(now.sum())
        now /= now.sum()
    return found


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.98])
@pytest.mark.parametrize("height", [0.5, 2.5])
@pytest.mark.parametrize("length", [4.0, 30.0])
def test_the_filter_is_the_sum_over_all_runs(memory, height, length):
    value, fresh = (noise(3) + teeth(2.0, 12.0))[:400], np.arange(400) % 150 == 0
    told = tooth_gain(Series(value, fresh), Noise(memory, 0.5, 1.0, 0.0), memory, height, length)
    assert told == pytest.approx(summed_over_runs(value, fresh, memory, 0.5, height, length), rel=1e-9)
    assert told != pytest.approx(summed_over_runs(value, fresh, memory, 0.5, height, 1.1 * length), rel=1e-4), "a planted fault"


@pytest.mark.parametrize("height", [1e-9, 0.0])
def test_no_teeth_is_the_limit_of_low_teeth(height):
    """A reading without white noise has traces of no height."""
    series = Series(noise(), np.arange(COUNT) == 0)
    fitted = fit_noise(series)
    assert tooth_gain(series, fitted, fitted.memory, height, 20.0) == pytest.approx(0.0, abs=1e-3)


def test_an_encoders_wave_is_taken_off_with_its_harmonics():
    """A planted fault: an interpolation error whose flanks are unlike is a sawtooth of the angle on every leg."""
    angle = np.concatenate([np.linspace(-side, side, COUNT // 4) for side in (1, -1, 1, -1)])
    phase = 2 * np.pi * 12.05 * angle
    wrong = -3.0 * np.arctan2(0.7 * np.sin(phase), 1 - 0.7 * np.cos(phase))
    direction = np.repeat([-1.0, 1.0, -1.0, 1.0], COUNT // 4)
    measured = noise() + wrong
    assert factor(measured * direction) > 20
    assert factor(without_wave(measured, angle, LEG, 12.0) * direction) < 2


def stairs(noise_nm=0.0, step=0.05):
    """A record whose torque rises in stairs, with blocks of eight samples."""
    time = np.arange(COUNT) * 0.01
    smooth = np.linspace(0.0, 1.0, COUNT)
    torque = (np.floor(smooth / step) * step if step else smooth) + noise_nm * np.random.default_rng(4).standard_normal(COUNT)
    blocks = SimpleNamespace(mid_s=time.reshape(-1, 8).mean(axis=1), torque_nm=smooth.reshape(-1, 8).mean(axis=1))
    return SimpleNamespace(time_s=time, torque_nm=torque), blocks


def test_a_torque_in_stairs_is_no_stick_slip():
    """What the angle does with the torque between blocks is taken off; left in (planted fault) it is teeth."""
    record, blocks = stairs(noise_nm=1e-3)
    angle = 100.0 * (record.torque_nm - np.linspace(0.0, 1.0, COUNT)) + noise()
    assert factor(angle) > 20
    assert factor(angle - 100.0 * between_blocks(record, blocks, 1e-3)) < 1.0


def test_the_noise_of_a_straight_torque_is_not_taken_for_stairs():
    assert np.abs(between_blocks(*stairs(noise_nm=1e-3, step=0.0), 1e-3)).max() < 3e-4


def resting(dwell_s, steps=1, seed=3):
    """A unit of constant compliance whose torque goes to and fro, each leg in steps with a rest after each; its contact sticks
    and leaps while it is pushed on. Rests are of half the time where those of a leg last as long as the leg, which is 2 s."""
    rng, records = np.random.default_rng(seed), []
    levels = np.concatenate([[0.0, 1.0], *[np.linspace(a, -a, steps + 1)[1:] for a in (1.0, -1.0, 1.0, -1.0)]])
    for rate in (0.5, 1.0):
        lasts = np.stack([np.abs(np.diff(levels)), np.full(levels.size - 1, dwell_s / steps)], axis=1).ravel() / rate
        tips = np.r_[0.0, np.cumsum(lasts)]
        time = np.arange(0.0, tips[-1], 0.004 / rate)
        torque = np.interp(time, tips, np.repeat(levels, 2)[1:])
        travel = np.r_[0.0, np.cumsum(np.abs(np.diff(torque)))]
        held = travel - np.maximum.accumulate(np.where(np.diff(travel // 0.1, prepend=0.0) > 0, travel, 0.0))
        sense = np.sign(np.diff(levels))[(np.searchsorted(tips, time, side="right") - 1) // 2]
        angle = 0.01 * torque - 3e-4 * sense * held / 0.1 + 1e-4 * rng.standard_normal(time.size)
        records.append(Record(f"{rate}.csv", time, torque + 1e-4 * rng.standard_normal(time.size), angle, rate, 1.0))
    reduced = reduce_unit(Unit("resting", 1.0, tuple(records)))
    return SimpleNamespace(reduced=reduced, predicted=[0.01 * b.torque_nm / reduced.angle_scale_rad for b in reduced.blocks])


@pytest.mark.parametrize(("dwell_s", "share"), [(0.0, 0.0), (0.5, 0.2), (2.0, 0.5)])
def test_where_the_torque_rests_is_seen(dwell_s, share):
    for blocks in resting(dwell_s).reduced.blocks:
        assert standstill(blocks)[1] == pytest.approx(share, abs=0.03)


def test_a_contact_that_is_not_pushed_on_does_not_leap(monkeypatch):
    """A planted fault: teeth are looked for while the torque rests."""
    moving, rested = (find_jumps(resting(dwell_s)).log_factor for dwell_s in (0.0, 2.0))
    assert moving > 30 and rested > 0.7 * moving
    monkeypatch.setattr(jumps, "standstill", lambda blocks: (np.zeros(blocks.count.size, bool), 0.0))
    assert find_jumps(resting(0.0)).log_factor == pytest.approx(moving, rel=0.1)
    assert find_jumps(resting(2.0)).log_factor < 0.0


@pytest.mark.parametrize("dwell_s", [0.5, 2.0])
def test_the_torque_from_sample_to_sample_is_that_of_the_moving_torque(dwell_s):

    def of_single_samples(linear):
        """White noise has no duration: which one is estimated, and how many samples make one value by it, is another matter."""
        noise = tuple(replace(n, correlation_time_s=1e-3) for n in linear.reduced.noise)
        return SimpleNamespace(reduced=replace(linear.reduced, noise=noise), predicted=linear.predicted)

    steps = [[teeth.step for teeth in residual_series(of_single_samples(resting(d)))] for d in (0.0, dwell_s)]
    assert steps[1] == pytest.approx(steps[0], rel=0.1)


def test_where_arrays_lie_in_memory_changes_nothing():
    """Short arrays that lay near one another were added up in another order: last digits changed from run to run."""
    rng, series, kept = np.random.default_rng(0), even_series(noise(), LEG, 1), []
    known, found = fit_noise(series), set()
    for _ in range(200):
        kept = [*kept[-20:], np.empty(rng.integers(1, 300))]
        found.add(tooth_gain(series, known, known.memory, 2.2, 4.0))
    assert len(found) == 1


def test_a_reading_almost_without_noise_has_a_likelihood():
    """Values 138 spreads from their noise; where two exponentials were multiplied, one of nothing and one beyond all numbers, a
    product without a value ended in a division by zero."""
    value = np.where(np.arange(400) % 90 == 0, 138.0, 0.0) * 0.00703
    told = tooth_gain(Series(value, np.arange(400) == 0), Noise(0.9998, 0.00703, 1.0, 0.0), 0.9998, 1.23, 4.0)
    assert np.isfinite(told)


def test_teeth_go_on_across_rests_within_a_leg():
    """A planted fault: each step of a stair is a run of its own, too short to tell teeth in."""
    unit = resting(2.0, steps=20)
    assert all(blocks[1] > 0.2 for blocks in map(standstill, unit.reduced.blocks))
    assert find_jumps(unit).log_factor > 15


def test_a_quick_return_makes_no_rest_of_slow_loading():
    tips = np.cumsum([0.0, 1.0, *[0.02, 4.0] * 4])
    time = np.arange(0.0, tips[-1], 0.002)
    torque = np.interp(time, tips, [0.0, -1.0, *[1.0, -1.0] * 4])
    noisy = 0.01 * torque + 1e-4 * np.random.default_rng(1).standard_normal(time.size)
    blocks = reduce_unit(Unit("quick", 1.0, (Record("quick.csv", time, torque, noisy, 0.5, 1.0),))).blocks[0]
    assert standstill(blocks)[1] < 0.02
