"""A periodic disturbance has one frequency in all records; teeth, clocks and traces are told from it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.planted import NOISE, changed, planted

from backdrive_bayes.engine import disturbance
from backdrive_bayes.engine.disturbance import common_line
from backdrive_bayes.engine.reduced import reduce_unit

SIZE = np.sqrt(2.0) * np.hypot(NOISE.white_rad, NOISE.correlated_rad)
HERTZ = 6.3


def factor(change=None, times=None, **options):
    """Evidence of a line in a unit whose loops are known."""
    quiet, unit = planted(noise=replace(NOISE, white_rad=0.0, correlated_rad=0.0), **options), planted(**options)
    unit = changed(unit, change) if change else unit
    quiet, reduced = (reduce_unit(times(u) if times else u) for u in (quiet, unit))
    known = [np.interp(b.mid_s, q.mid_s, q.angle_rad) for b, q in zip(reduced.blocks, quiet.blocks, strict=True)]
    return common_line(SimpleNamespace(reduced=reduced, predicted=[angle / reduced.angle_scale_rad for angle in known]))


def wave(size, hertz):
    """A wave of the size of the noise times ``size`` at ``hertz(record)`` in time, of another phase in each record."""
    return lambda r, i: size * SIZE * np.sin(2 * np.pi * hertz(r) * r.time_s + i)


@pytest.mark.parametrize(("hertz", "size"), [(HERTZ, 1.0), (47.0, 0.4), (47.0, 1.0)])
def test_one_frequency_in_time_speaks(hertz, size):
    assert factor(wave(size, lambda r: hertz)) > 5


@pytest.mark.parametrize("seed", range(4))
def test_noise_does_not(seed):
    assert factor(seed=seed) < 1


@pytest.mark.parametrize("size", [0.4, 1.0])
def test_what_comes_at_even_torques_does_not(size):
    """A planted fault: the same waves at one frequency speak."""
    assert factor(wave(size, lambda r: 200.0 * r.loading_rate_nm_per_s)) < 1
    assert factor(wave(size, lambda r: 200.0 * 0.02)) > 5


def test_a_frequency_of_each_record_does_not():
    assert factor(wave(1.0, lambda r: 31.0 + 200.0 * r.loading_rate_nm_per_s)) < 1


def test_one_record_cannot_tell():
    assert abs(factor(wave(1.0, lambda r: HERTZ), loops=((0.1, 0.1),))) < 1


def test_a_trace_does_not_but_would_on_a_bench_without_traces(monkeypatch):
    trace = wave(0.1, lambda r: 47.0)
    assert factor(trace) < 3
    monkeypatch.setattr(disturbance, "TRACE", 0.0)
    assert factor(trace) > 6


def test_records_at_uneven_times_show_it_too():
    def thinned(unit):
        rng, records = np.random.default_rng(1), []
        for r in unit.records:
            keep = np.sort(rng.permutation(r.time_s.size)[: r.time_s.size // 2])
            records.append(replace(r, time_s=r.time_s[keep], torque_nm=r.torque_nm[keep], angle_rad=r.angle_rad[keep]))
        return replace(unit, records=tuple(records))

    assert factor(wave(1.0, lambda r: HERTZ), thinned) > 5


def test_a_record_of_more_gaps_than_samples_tells_nothing():
    time = np.r_[np.arange(2000), 1e7 + np.arange(2000)] / 400.0
    rest = np.sin(2 * np.pi * HERTZ * time) + np.random.default_rng(0).standard_normal(time.size)
    found = disturbance.spectrum(time, rest, 1.0, 5.0)
    assert not found.gains(np.arange(1.0, 150.0), [1.0])[1].any() and found.power.size < 8 * time.size
    assert disturbance.spectrum(time[:2000], rest[:2000], 1.0, 5.0).gains(np.array([HERTZ]), [1.0])[0].max() > 100
