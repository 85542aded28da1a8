"""Mechanical elements against cases that can be worked out by hand."""

import numpy as np
import pytest

from backdrive_bayes.bench.sliders import elements


def test_a_slider_lags_by_its_band():
    force = np.r_[np.linspace(0, 5, 51), np.linspace(5, -5, 101)[1:]]
    behind = elements.sliders(force, np.full((force.size, 1), 1.0))[:, 0]
    assert behind[50] == pytest.approx(4) and behind[-1] == pytest.approx(-4)
    assert np.all(behind[50:71] == behind[50]), "stuck over twice the band after turning"


def test_a_gap_is_crossed_at_its_drag():
    torque = np.r_[np.linspace(0, 1, 101), np.linspace(1, -1, 201)[1:]]
    place = elements.gaps(torque, np.full((torque.size, 1), 0.3), np.zeros(1), np.full(1, 1e-6), np.full(1, 1e-6), -1.0)[:, 0]
    assert torque[np.argmax(place > 0)] == pytest.approx(0.31, abs=0.011)
    assert torque[101 + np.argmax(place[101:] < 0)] == pytest.approx(-0.3, abs=0.011)


def test_stops_end_the_travel():
    assert elements.stops(np.array([-3.0, 0.5, 3.0]), np.array([1.0, 2.0]), np.array([0.5, 0.5])).tolist() == [-1.5, 0.5, 1.5]


def test_a_dashpot_relaxes_with_its_time_constant():
    time = np.linspace(0, 3, 301)
    crept = elements.dashpots(time, np.ones(301), 2.0)[:, 0]
    np.testing.assert_allclose(crept, 1 - np.exp(-time / 2.0), atol=1e-12)


def test_a_filter_follows_a_ramp_late_by_its_time_constant():
    time = np.sort(np.random.default_rng(0).uniform(0, 3, 301))
    late = elements.relaxed(time, 2.0 * (time - time[0]), 0.1)
    np.testing.assert_allclose(late, 2.0 * (time - time[0] - 0.1 * (1 - np.exp(-(time - time[0]) / 0.1))), atol=1e-12)


def test_a_dashpot_rests_below_its_threshold():
    assert not elements.dashpots(np.arange(10.0), np.full(10, 0.5), 1.0, threshold=0.6).any()
    assert elements.dashpots(np.arange(100.0), np.ones(100), 1.0, threshold=0.6)[-1, 0] == pytest.approx(0.4)
