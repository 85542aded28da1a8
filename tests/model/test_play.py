"""The play operator's closed form over monotone legs against the step-by-step definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.known import random_torques

from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.play import play

SEEDS = st.integers(0, 2**32 - 1)


def boundary(rng):
    """A rising lower boundary that stays under its mirror image, for three operators at once."""
    drag, width = rng.uniform(0.0, 0.08, (3, 1)), rng.uniform(0.002, 0.1, (3, 1))
    linear = rng.random() < 0.5
    return lambda t: t - drag if linear else np.tanh((t - drag) / width)


def brute_force(torque, lower, state):
    """The definition: at every sample the state is moved between both boundaries, and no further."""
    out = np.empty((3, torque.size))
    for k, t in enumerate(torque):
        one = np.array([t])
        state = np.clip(state, lower(one), -lower(-one))
        out[:, k] = state[:, 0]
    return out


def forgetful(torque, lower, state):
    """A planted fault: forgets the state at every turning point."""
    path = TorquePath.from_samples(torque)
    out = play(path, lower, state)
    for leg in path.legs[1:]:
        out[:, leg.start : leg.stop] = lower(torque[leg.start : leg.stop])
    return out


@given(SEEDS)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_closed_form_is_the_recursion(seed):
    rng = np.random.default_rng(seed)
    torque, lower = random_torques(rng, turns=int(rng.integers(1, 15))), boundary(rng)
    state = rng.uniform(-1, 1, (3, 1)) * rng.choice([0.05, 1.0])
    expected = brute_force(torque, lower, state)
    found = play(TorquePath.from_samples(torque), lower, state)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13)


def test_a_forgetful_operator_is_found_out():
    rng = np.random.default_rng(0)
    torque, lower, state = random_torques(rng), boundary(rng), np.zeros((3, 1))
    assert np.abs(forgetful(torque, lower, state) - brute_force(torque, lower, state)).max() > 1e-3


@pytest.mark.parametrize(
    ("past", "expected"), [(-np.inf, [-0.05, -0.04, -0.03]), (np.inf, [0.05, 0.05, 0.05])]
)
def test_any_past_is_moved_between_the_boundaries(past, expected):
    path = TorquePath.from_samples(np.array([0.0, 0.01, 0.02]))
    found = play(path, lambda t: t - np.full((1, 1), 0.05), np.full((1, 1), past))
    np.testing.assert_allclose(found, [expected], atol=1e-15)


def test_rate_does_not_matter():
    rng = np.random.default_rng(3)
    torque, lower = random_torques(rng), boundary(rng)
    fine = np.interp(np.arange(0, torque.size - 1, 0.25), np.arange(torque.size), torque)
    coarse = play(TorquePath.from_samples(torque), lower, np.zeros((3, 1)))
    np.testing.assert_allclose(
        play(TorquePath.from_samples(fine), lower, np.zeros((3, 1)))[:, ::4], coarse[:, :-1], atol=1e-14
    )
