"""A periodic disturbance has one frequency in all records; teeth, clocks and traces are told from it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.planted import NOISE, changed, planted

from backdrive_bayes.engine import disturbance as engine
from backdrive_bayes.engine.log_mean import log_mean
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.engine.residuals import residuals

SIZE = np.sqrt(2.0) * np.hypot(NOISE.white_rad, NOISE.correlated_rad)
HERTZ = 6.3
SAME_RATE = ((0.1, 0.05), (0.08, 0.05), (0.06, 0.05))
FOUR = ((0.1, 0.02), (0.1, 0.03), (0.1, 0.05), (0.1, 0.1))


def reduced_unit(change=None, times=None, **options):
    unit = planted(**options)
    unit = changed(unit, change) if change else unit
    return reduce_unit(times(unit) if times else unit)


def factor(change=None, times=None, **options):
    return engine.disturbance(reduced_unit(change, times, **options))


def wave(size, hertz):
    """A wave of root mean square ``size`` times the noise at ``hertz(record)`` in time, of another phase in each record."""
    return lambda r, i: size * SIZE * np.sin(2 * np.pi * hertz(r) * r.time_s + i)


def dwelling(unit):
    """Every record rests half a second in its middle, where the torque stands."""
    records = []
    for r in unit.records:
        at, rest = r.time_s.size // 2, int(0.5 / r.time_s[1])
        order = np.r_[np.arange(at), np.full(rest, at), np.arange(at, r.time_s.size)]
        time = r.time_s[1] * np.arange(order.size)
        records.append(replace(r, time_s=time, torque_nm=r.torque_nm[order], angle_rad=r.angle_rad[order]))
    return replace(unit, records=tuple(records))


@pytest.mark.parametrize(("hertz", "size"), [(HERTZ, 1.0), (47.0, 0.4), (47.0, 1.0)])
def test_one_frequency_in_time_speaks(hertz, size):
    assert factor(wave(size, lambda r: hertz)) > 5


def test_it_may_wander_as_the_mains_do():
    """A planted fault: without a tolerance lines a half per mille apart are two."""
    loops = ((0.1, 0.008), (0.1, 0.02))
    wandering = wave(1.0, lambda r: 47.0 * (1.0 + 1e-3 * (r.loading_rate_nm_per_s > 0.01)))
    assert factor(wandering, loops=loops) > 4


def test_it_need_not_be_seen_in_every_record():
    assert factor(lambda r, i: (i < 3) * wave(1.0, lambda r: 47.0)(r, i), loops=FOUR) > 10


def test_every_record_has_a_zero_of_its_own():
    line = wave(0.4, lambda r: 47.0)
    assert factor(lambda r, i: line(r, i) + 0.3 * i) == pytest.approx(factor(line), abs=0.01)


@pytest.mark.parametrize("seed", range(4))
def test_noise_does_not(seed):
    assert factor(seed=seed) < 1


def test_the_noise_about_a_frequency_is_known_at_the_lowest_too():
    """White noise has power one in the mean wherever a frequency can be told."""
    found, record = [], planted().records[1]
    for seed in range(12):
        rest = np.random.default_rng(seed).standard_normal(record.time_s.size)
        blocks = SimpleNamespace(begin_s=[0.0], end_s=[record.time_s[-1]], direction=np.ones(1))
        found.append(engine.periodogram(record, blocks, rest, 1.0).power[16:200])
    assert np.abs(np.mean(found, axis=0) - 1.0).mean() < 0.35 and np.mean(found) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("times", [None, dwelling])
def test_what_comes_at_even_torques_does_not(times):
    """A planted fault: a ripple of the torque at one rate is a line in time to whoever does not know the torque."""
    reduced = reduced_unit(lambda r, i: SIZE * np.cos(2 * np.pi * r.torque_nm / 2e-3), times, loops=SAME_RATE)
    assert engine.disturbance(reduced) <= np.log(2.0)
    rest = residuals(reduced, reduced.angles)
    each = [engine.periodogram(*one, SIZE) for one in zip(reduced.unit.records, reduced.blocks, rest, strict=True)]
    assert log_mean(engine.shared(each, SIZE * engine.SIZES, np.ones(3))) > 5


def test_records_of_one_rate_cannot_tell():
    assert factor(wave(1.0, lambda r: 47.0), loops=SAME_RATE) == pytest.approx(np.log(2.0), abs=0.2)


def test_a_frequency_of_each_record_does_not():
    assert factor(wave(1.0, lambda r: 31.0 + 333.0 * r.loading_rate_nm_per_s), loops=FOUR) < 0.5


def test_one_record_cannot_tell():
    assert abs(factor(wave(1.0, lambda r: HERTZ), loops=((0.1, 0.1),))) < 1


def test_a_trace_does_not_but_would_on_a_bench_without_traces(monkeypatch):
    trace = wave(0.1, lambda r: 47.0)
    assert factor(trace) < 3
    monkeypatch.setattr(engine, "TRACE", 0.0)
    assert factor(trace) > 5


def test_records_at_uneven_times_show_it_too():
    def thinned(unit):
        rng, records = np.random.default_rng(1), []
        for r in unit.records:
            keep = np.sort(rng.permutation(r.time_s.size)[: int(0.7 * r.time_s.size)])
            records.append(replace(r, time_s=r.time_s[keep], torque_nm=r.torque_nm[keep], angle_rad=r.angle_rad[keep]))
        return replace(unit, records=tuple(records))

    assert factor(wave(1.0, lambda r: 20.0), thinned) > 5


def test_a_line_above_half_the_sampling_rate_shows_folded():
    """A planted fault: at 40 samples a second 47 Hz show as 7, which the other record does not have."""

    def coarse(unit):
        slow = unit.records[0]
        cut = replace(slow, time_s=slow.time_s[::10], torque_nm=slow.torque_nm[::10], angle_rad=slow.angle_rad[::10])
        return replace(unit, records=(cut, *unit.records[1:]))

    assert factor(wave(1.0, lambda r: 47.0), coarse) > 5
    assert factor(lambda r, i: wave(1.0, lambda r: 47.0 if i else 7.0)(r, i), loops=((0.1, 0.02), (0.1, 0.1))) < 1


def test_nothing_is_told_of_more_gaps_than_samples():
    time = np.r_[np.arange(2000), 1e7 + np.arange(2000)] / 400.0
    assert engine.periodogram(SimpleNamespace(time_s=time), None, np.zeros(4000), 1.0) is None


def test_records_of_gaps_tell_nothing_together(monkeypatch):
    monkeypatch.setattr(engine, "GAPS", 0)
    assert factor(wave(1.0, lambda r: 47.0)) == 0.0
