"""Lines in the spectrum of the angle's noise: a hum is found, noise and a bench's own resonance are none."""

from dataclasses import replace

import numpy as np
import pytest
from support.planted import HERTZ, NOISE, planted

from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.check import check_record
from backdrive_bayes.records.lines import Line, clearest_line
from backdrive_bayes.records.noise import ChannelRecord, estimate_noise


def line_of(added, seed=0):
    """The highest line of a planted record with ``added(time_s, rng)`` [rad] on its angle."""
    record = planted(seed).records[0]
    angle = record.angle_rad + added(record.time_s, np.random.default_rng(seed))
    segments = find_segments(record.time_s, record.torque_nm)
    noise = estimate_noise(record.time_s, record.torque_nm, angle, segments)
    return clearest_line(ChannelRecord(record.time_s, record.torque_nm, angle, segments), noise)


@pytest.mark.parametrize("hertz", [7.0, 50.0, 450.0])
def test_a_hum_is_found_at_its_frequency_as_sampled(hertz):
    line = line_of(lambda t, rng: 4e-4 * np.sin(2 * np.pi * hertz * t))
    folded = abs(hertz - HERTZ * round(hertz / HERTZ))
    assert line.disturbs and line.power_ratio > 76 and line.frequency_hz == pytest.approx(folded, abs=2.0)


@pytest.mark.parametrize("size", [0.0, 4e-4])
@pytest.mark.parametrize("seed", range(6))
def test_noise_has_none_however_much_there_is(seed, size):
    line = line_of(lambda t, rng: size * rng.standard_normal(t.size), seed)
    assert line.power_ratio < 3 and not line.disturbs


def test_the_lines_of_any_bench_do_not_disturb():
    """Eleven measured units reach a ratio of 17."""
    assert [Line(50.0, ratio).disturbs for ratio in (0.5, 2.0, 8.0, 17.0, 20.0, 50.0, 1e3)] == [False] * 4 + [True] * 3


@pytest.mark.parametrize("hertz", [7.0, 50.0, 450.0])
def test_its_amplitude_is_known(hertz):
    line = line_of(lambda t, rng: 4e-4 * np.sin(2 * np.pi * hertz * t))
    assert line.amplitude_rad == pytest.approx(4e-4, rel=0.3)


@pytest.mark.parametrize("step", [1e-5, 1e-4])
def test_the_staircase_of_an_encoder_without_noise_is_no_hum(step):
    """As regular as the ramp, it has thousands of times the power of what is about it; a hum above it is still found."""
    record = planted(0, noise=replace(NOISE, white_rad=0.0, correlated_rad=0.0)).records[0]

    def stepped(added=0.0):
        angle = step * np.round((record.angle_rad + added) / step)
        segments = find_segments(record.time_s, record.torque_nm)
        noise = estimate_noise(record.time_s, record.torque_nm, angle, segments)
        return clearest_line(ChannelRecord(record.time_s, record.torque_nm, angle, segments), noise)

    assert not stepped().disturbs and stepped().power_ratio > 20
    assert stepped(3 * step * np.sin(2 * np.pi * 50.0 * record.time_s)).disturbs


def test_the_check_warns_of_it():
    record = planted(0).records[0]
    humming = replace(record, angle_rad=record.angle_rad + 4e-4 * np.sin(2 * np.pi * 50.0 * record.time_s))
    told = [[f["code"] for f in check_record(r, 0.1)["findings"]] for r in (record, humming)]
    assert "periodic_disturbance" not in told[0] and "periodic_disturbance" in told[1]
