"""Noise of simulated records: what was put in comes out, with standard errors that mean something."""

import numpy as np
import pytest
from support.bench import KNOWN_NOISE, unit_of

from backdrive_bayes.bench.known_truth import BenchNoise, angle_noise
from backdrive_bayes.records import noise
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.noise import ChannelRecord, estimate_common_noise, estimate_noise
from backdrive_bayes.records.white_noise import white_noise

FIELDS = ("white_rad", "correlated_rad", "correlation_time_s", "torque_nm")
SEEDS = range(5)


def channel(record):
    return ChannelRecord(
        record.time_s, record.torque_nm, record.angle_rad, find_segments(record.time_s, record.torque_nm)
    )


def estimated(seed, rate, noise=KNOWN_NOISE):
    c = channel(unit_of(seed, rate=rate, noise=noise).records[0])
    return estimate_noise(c.time_s, c.torque_nm, c.angle_rad, c.segments)


def ratios(rate, truth=KNOWN_NOISE, used=KNOWN_NOISE):
    """Estimate over truth, shape (seeds, fields)."""
    found = [[getattr(estimated(s, rate, used), f) / getattr(truth, f) for f in FIELDS] for s in SEEDS]
    return np.array(found)


def within(values, factors):
    return (np.abs(np.log(values)) < np.log(factors)).all()


LONG, SHORT = (1.05, 1.25, 1.5, 1.03), (1.1, 1.6, 2.0, 1.05)


@pytest.mark.parametrize(("rate", "factors"), [(0.01, LONG), (0.05, SHORT)], ids=["50 s", "10 s"])
def test_known_noise_is_recovered(rate, factors):
    assert within(ratios(rate), factors)


def test_wrong_noise_would_be_noticed():
    doubled = BenchNoise(
        2 * KNOWN_NOISE.white_rad, 2 * KNOWN_NOISE.correlated_rad, 0.06, 2 * KNOWN_NOISE.torque_nm
    )
    assert not within(ratios(0.05, used=doubled), SHORT)


def test_errors_are_within_their_standard_errors():
    pulls = []
    for seed in range(12):
        found = estimated(seed, 0.05)
        pulls.append(
            [(getattr(found, f) - getattr(KNOWN_NOISE, f)) / getattr(found, f"{f}_sd") for f in FIELDS]
        )
    spread = np.sqrt(np.mean(np.square(pulls), axis=0))
    assert (spread < 2.0).all() and (spread > 0.2).all(), dict(zip(FIELDS, spread, strict=True))


def test_units_of_angle_and_torque_only_scale_the_result():
    c = channel(unit_of(0, rate=0.05).records[0])
    small, big = (
        estimate_noise(c.time_s, c.torque_nm, c.angle_rad, c.segments),
        estimate_noise(c.time_s, 30 * c.torque_nm, 1000 * c.angle_rad, c.segments),
    )
    assert big.white_rad == pytest.approx(1000 * small.white_rad, rel=1e-3)
    assert big.correlated_rad == pytest.approx(1000 * small.correlated_rad, rel=1e-3)
    assert big.correlation_time_s == pytest.approx(small.correlation_time_s, rel=1e-3)
    assert big.torque_nm == pytest.approx(30 * small.torque_nm, rel=1e-9)


def test_records_of_one_bench_share_the_angle_noise():
    records = [
        channel(unit_of(s, rate=0.05, noise=n).records[0])
        for s, n in ((0, KNOWN_NOISE), (1, BenchNoise(torque_nm=5e-4)))
    ]
    first, second = estimate_common_noise(records)
    assert (first.white_rad, first.correlated_rad) == (second.white_rad, second.correlated_rad)
    assert second.torque_nm / first.torque_nm == pytest.approx(5, rel=0.05)
    alone = estimate_noise(records[0].time_s, records[0].torque_nm, records[0].angle_rad, records[0].segments)
    assert first.correlated_rad_sd < alone.correlated_rad_sd


def test_an_angle_that_follows_a_torque_in_stairs_is_no_noise():
    """The torque is moved in stairs of a fifth of the windows' length, the angle with it; without the torque beside (planted
    fault) the stairs are taken for noise."""
    record = unit_of(3, rate=0.05).records[0]
    turned = np.interp(np.arange(record.time_s.size), *_stairs(record.time_s.size))
    angle = record.angle_rad + 0.2 * (np.interp(turned, np.arange(record.time_s.size), record.torque_nm) - record.torque_nm)
    moved = np.interp(turned, np.arange(record.time_s.size), record.torque_nm)
    segments = find_segments(record.time_s, record.torque_nm)
    with_torque, without = (
        estimate_noise(record.time_s, torque, angle, segments).correlated_rad for torque in (moved, record.torque_nm)
    )
    assert with_torque < 1.5 * KNOWN_NOISE.correlated_rad and without > 2.0 * with_torque


@pytest.mark.parametrize("legs", [95, 300])
def test_a_short_record_with_a_steep_step_shows_its_noise_all_the_same(legs, monkeypatch):
    """Windows of a third of the shorter legs (planted fault, 32 samples) take the loop's own shape for noise."""
    rng, turns = np.random.default_rng(0), 6
    torque = np.concatenate([s * np.linspace(-1.0, 1.0, legs)[:-1] for s in (1, -1) * (turns // 2)])
    rising = np.repeat((1, -1) * (turns // 2), legs - 1)
    angle = torque + np.tanh((torque - 0.03 * rising) / 0.02) + 0.1 * torque**3
    sd = 1e-3
    time = np.arange(torque.size) * 0.1
    read, turned = torque + 1e-4 * rng.standard_normal(time.size), angle + sd * rng.standard_normal(time.size)
    segments = find_segments(time, read)

    def level():
        found = estimate_noise(time, read, turned, segments)
        return np.hypot(found.white_rad, found.correlated_rad)

    assert 0.8 * sd < level() < 1.6 * sd
    monkeypatch.setattr(noise, "SHORTEST_WINDOW", 32)
    assert legs > 100 or level() > 1.6 * sd


def test_a_coarsely_rounded_channel_has_noise_though_its_times_are_rounded_too():
    """Most samples lie on the line through their neighbours, but for the last digit of their times."""
    rng = np.random.default_rng(0)
    time = np.round(np.arange(4000) * 0.0137 + 1e-7 * rng.standard_normal(4000), 6)
    values = np.round((0.01 * time + 1e-4 * rng.standard_normal(time.size)) / 4e-3) * 4e-3
    assert 1e-4 < white_noise(values, time) < 4e-3


def _stairs(samples, step=50):
    """Sample numbers that rest and leap."""
    edges = np.arange(0, samples, step)
    return np.sort(np.r_[edges, edges[1:] - 1]), np.repeat(edges, 2)[: 2 * edges.size - 1]


@pytest.mark.parametrize("in_samples", [True, False])
def test_noise_lasts_for_a_time_or_for_samples(in_samples, monkeypatch):
    """Records read at 100 Hz and at 10 Hz. Where noise of samples is taken to last for a time (planted fault), the mean of a slow
    record's blocks is far more certain than it is."""
    rng, torque = np.random.default_rng(1), np.concatenate([np.linspace(-1, 1, 1500), np.linspace(1, -1, 1500)] * 2)
    records, times = [], []
    for step in (0.01, 0.1):
        times.append(8 * step if in_samples else 0.05)
        added = angle_noise(torque.size, step, BenchNoise(1e-4, 1e-4, times[-1], 0.0), rng)
        time = np.arange(torque.size) * step
        read = torque + 1e-5 * rng.standard_normal(torque.size)
        records.append(ChannelRecord(time, read, 0.1 * torque + added, find_segments(time, torque)))

    def slow(estimates):
        """Variance of long means of the slow record over the true one, but for the white part."""
        return (estimates[1].correlated_rad / 1e-4) ** 2 * estimates[1].correlation_time_s / times[1]

    assert 0.5 < slow(estimate_common_noise(records)) < 2.0
    monkeypatch.setattr(noise, "ALIKE", np.inf)
    assert (slow(estimate_common_noise(records)) < 0.5) is in_samples


@pytest.mark.parametrize("step_s", [2e-4, 0.02])
def test_the_clock_does_not_make_noise_of_the_loop_s_shape(step_s, monkeypatch):
    """A record of .8 s. Where its noise may last for longer than a window (planted fault), what a window's trend leaves of the
    loop's shape is taken for noise, and the mean of a quarter of a leg is far less certain than it is."""
    rng = np.random.default_rng(1)
    torque = np.concatenate([np.linspace(-1.0, 1.0, 2000), np.linspace(1.0, -1.0, 2000)])
    angle = torque + 0.3 * np.tanh(torque / 0.1) + 1e-3 * rng.standard_normal(4000)
    time, read = step_s * np.arange(4000), torque + 1e-5 * rng.standard_normal(4000)

    def mean_of_a_quarter():
        """Its standard deviation in the true one."""
        found, count = estimate_noise(time, read, angle, find_segments(time, torque)), 500
        slow = found.correlated_rad**2 * np.exp(-step_s / found.correlation_time_s * np.arange(count))
        shares = (1.0 - np.arange(count) / count) / count
        return np.sqrt(2.0 * slow @ shares - slow[0] / count + found.white_rad**2 / count) * np.sqrt(count) / 1e-3

    assert 0.8 < mean_of_a_quarter() < 1.6
    monkeypatch.setattr(noise, "WANDERS_FROM", np.inf)
    assert bool(mean_of_a_quarter() > 2.5) is (step_s < 0.001)


@pytest.mark.parametrize("step_s", [5.0, 20.0, 300.0])
def test_records_read_less_often_than_noise_lasts_have_a_noise(step_s):
    """Dead weights put on by hand: no bound of the noise's duration lies below the step from sample to sample."""
    rng = np.random.default_rng(3)
    torque = np.repeat(np.r_[np.arange(0, 9), np.arange(7, -9, -1), np.arange(-7, 9)] / 8.0, 5)
    time = step_s * np.arange(torque.size)
    angle = 1e-3 * torque + 1e-5 * rng.standard_normal(torque.size)
    found = estimate_noise(time, torque + 1e-4 * rng.standard_normal(torque.size), angle, find_segments(time, torque))
    assert np.hypot(found.white_rad, found.correlated_rad) == pytest.approx(1e-5, rel=0.4)
