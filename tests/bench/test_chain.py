"""The measurement chain: instants, stamps and digits."""

import numpy as np
import pytest

from backdrive_bayes.bench.chain import SAMPLING_HZ, Chain, draw_chain, sample_times, write_down
from backdrive_bayes.bench.channel_noise import ChannelNoise

NOISE = ChannelNoise(1e-5, 3e-5, 0.03, 1e-4)
SILENT = ChannelNoise(0.0, 0.0, 0.03, 0.0)


def chains(count=60, hertz=None, level=1.0):
    return [draw_chain(np.random.default_rng(seed), NOISE, hertz, level) for seed in range(count)]


def test_a_clean_bench_takes_even_samples_and_writes_all_digits():
    chain = chains(1, 500.0, level=0.0)[0]
    time = sample_times(np.random.default_rng(0), chain, 2.0)
    np.testing.assert_allclose(time, np.arange(1001) / 500.0, atol=1e-12)
    stamps, torque, angle = write_down(np.random.default_rng(0), chain, SILENT, time, np.sin(time), np.cos(time))
    np.testing.assert_array_equal(stamps, time)
    np.testing.assert_array_equal(torque, np.sin(time))
    np.testing.assert_array_equal(angle, np.cos(time))


def test_the_sampling_frequency_is_drawn_only_where_none_is_asked_for():
    assert {chain.sampling_hz for chain in chains(hertz=250.0)} == {250.0}
    drawn = [chain.sampling_hz for chain in chains()]
    assert min(drawn) >= SAMPLING_HZ[0] and max(drawn) <= SAMPLING_HZ[1] and len(set(drawn)) > 20


def test_most_clocks_are_even_and_no_time_runs_backwards():
    drawn = chains()
    assert 20 < sum(not c.uneven and not c.stamp_jitter for c in drawn) < 50
    for chain in drawn:
        time = sample_times(np.random.default_rng(1), chain, 3.0)
        stamps, _, _ = write_down(np.random.default_rng(2), chain, NOISE, time, time, time)
        assert np.all(np.diff(time) > 0) and np.all(np.diff(stamps) > 0) and time[0] >= 0 and time[-1] <= 3.0


@pytest.mark.parametrize("seed", range(3))
def test_readings_lie_on_the_steps_of_their_converters(seed):
    chain = Chain(1000.0, 0.0, 0.0, 2e-5, 3e-4, 0.0, 20.0)
    time = np.linspace(0, 1, 1001)
    _, torque, angle = write_down(np.random.default_rng(seed), chain, NOISE, time, time, 1e-3 * time)
    for values, step in ((torque, 3e-4), (angle, 2e-5)):
        np.testing.assert_allclose(values / step, np.round(values / step), atol=1e-6)
