"""Levels between which a torque runs: a rest at the tip does not raise them, an end of the record is no tip."""

import numpy as np
import pytest
from conftest import ramps
from test_measured_loop import TRUTH, loop, play

from backdrive_bayes.records import shape
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.check import check_record
from backdrive_bayes.records.record import Record

KNOTS = (0, 1, -1, 1, -1, 1)


def levels(time, torque):
    segments = find_segments(time, torque)
    return shape.turning_levels(time, torque, segments) * [s.direction for s in segments[:-1]]


@pytest.mark.parametrize("dwell", [0.0, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_a_rest_at_the_tips_does_not_raise_them(dwell, noise, monkeypatch):
    time, torque = ramps(KNOTS, rate=0.1, dwell=dwell, noise=noise)
    np.testing.assert_allclose(levels(time, torque), 1.0, atol=0.003 + 0.3 * noise)
    monkeypatch.setattr(shape, "_RESTS", 1)
    high = np.max(levels(time, torque)) - 1.0
    assert high > 0.015 if dwell else high < 0.004, "a line through ramp and rest goes beyond both (planted fault)"


def test_noise_adds_no_bias_to_a_tip_without_a_rest():
    """The mean over many tips lies on the tip, within three of its standard errors and half a step of the torque."""
    found = np.ravel([levels(*ramps(KNOTS, rate=0.1, noise=0.02, seed=seed)) for seed in range(40)])
    assert abs(found.mean() - 1.0) < 3 * found.std() / np.sqrt(found.size) + 0.00025
    assert found.std() < 0.004
    highest = [np.abs(ramps(KNOTS, rate=0.1, noise=0.02, seed=seed)[1]).max() for seed in range(40)]
    assert np.mean(highest) > 1.03, "the highest sample is a tip and noise (planted fault)"


def test_a_gap_before_the_tip_moves_it_by_nothing():
    time, torque = ramps(KNOTS, rate=0.1)
    keep = (np.abs(torque) < 0.9) | (np.abs(torque) > 0.95)
    np.testing.assert_allclose(levels(time[keep], torque[keep]), 1.0, atol=0.002)


@pytest.mark.parametrize("dwell", [0.0, 0.5, 1.0])
def test_a_rest_at_the_tips_takes_nothing_from_the_area(dwell):
    time, torque = ramps((0, 1, -1, 1), rate=0.1, dwell=dwell)
    noise = np.random.default_rng(0).normal(size=(2, len(time)))
    found = loop(torque + 1e-3 * noise[0], play(torque) + 2e-5 * noise[1], time)
    assert found.loop_area_j == pytest.approx(TRUTH[0], rel=0.005)
    assert found.amplitude_nm == pytest.approx(1.0, abs=0.002)


@pytest.mark.parametrize(
    ("knots", "low", "high"),
    [((0.85, -1, 1, -1, 0.85), -1, 1), ((1, -1, 1), -1, 1), ((0, 1, -0.9), -0.9, 1), ((0.2, 0.9), 0.2, 0.9)],
)
def test_an_end_of_the_record_is_a_tip_only_where_it_lies_further_out(knots, low, high):
    time, torque = ramps(knots, noise=0.001, rate=0.1)
    found = check_record(Record("r", time, torque, play(torque), amplitude_nm=0.5 * (high - low)), 1.0)
    assert found["torque_range_Nm"] == pytest.approx([low, high], abs=0.004)
    assert "declared" not in [row["code"] for row in found["findings"]]
    assert ("off_centre" in [row["code"] for row in found["findings"]]) == (abs(low + high) > 0.02)
