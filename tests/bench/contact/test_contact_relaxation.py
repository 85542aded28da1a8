"""Exact relaxation and parallel patches of the contact bench against closed forms."""

import numpy as np
import pytest

from backdrive_bayes.bench.contact.patches import joint_turn
from backdrive_bayes.bench.contact.relaxation import relax, relaxed_at, yielding_relax


def test_a_ramp_is_followed_exactly_on_any_grid():
    time = np.sort(np.r_[0.0, np.random.default_rng(0).uniform(0, 4, 30), 4.0])
    exact = 2.0 * (time - 0.7 * (1.0 - np.exp(-time / 0.7)))
    assert np.allclose(relax(time, 2.0 * time, 0.7 + 0j).real, exact, atol=1e-12)
    between = np.linspace(0.1, 3.9, 17)
    expected = 2.0 * (between - 0.7 * (1.0 - np.exp(-between / 0.7)))
    assert np.allclose(relaxed_at(time, 2.0 * time, 0.7, between).real, expected, atol=1e-12)


def test_times_that_coincide_are_a_step():
    time, target = np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 0.0, 1.0, 1.0])
    assert relax(time, target, 0.5 + 0j).real[-1] == pytest.approx(1.0 - np.exp(-2.0))


def test_a_yielding_element_stops_at_its_threshold():
    time = np.linspace(0.0, 50.0, 2001)
    assert yielding_relax(time, np.ones(2001), 1.0, 0.3)[-1] == pytest.approx(0.7, abs=1e-6)


def test_patches_let_go_at_their_limits():
    load = np.r_[np.linspace(0, 1, 101), np.linspace(1, 0, 101)]
    turn = joint_turn(load, np.array([0.25, 0.25]), np.array([0.1, 0.15]), 0.5)
    assert np.allclose(turn[:41], load[:41]) and turn[100] == pytest.approx((1.0 - 0.25) / 0.5)
    assert turn[101 + 50] == pytest.approx(turn[100] - 0.5)
