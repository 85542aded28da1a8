"""Prediction of torque histories: the known reducer's angle within its interval, honest at the ends of what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_posterior import OFFSET, known, made_posterior

from backdrive_bayes.engine import prediction
from backdrive_bayes.engine.prediction import nodes, predict_angles, rate_caveat, require_range, rest_caveat
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.registry import LIBRARY


def minor_loops():
    corner = 0.1 * np.array([0.0, 0.9, 0.3, 0.7, -0.5, 0.2, -0.9, 0.0])
    time = np.linspace(0, 10, 400)
    return time, np.interp(time, np.linspace(0, 10, corner.size), corner)


def test_from_rest_the_known_angle_lies_within():
    truth, (time, torque) = known(), minor_loops()
    curves = predict_angles(made_posterior(truth), time, torque, "rest", 200)
    expected = truth.angle_rad(time, torque) + OFFSET
    lo, hi = np.quantile(curves, [0.01, 0.99], axis=0)
    assert curves.shape == (200, 400) and np.isfinite(curves).all()
    assert ((expected > lo - 5e-5) & (expected < hi + 5e-5)).all()


def test_an_unknown_state_is_wider_until_the_first_large_torque():
    time, torque = minor_loops()
    rest, unknown = (predict_angles(made_posterior(), time, torque, s).std(axis=0) for s in ("rest", "unknown"))
    assert unknown[0] > 10 * rest[0] and unknown[-1] < 1.3 * rest[-1]


def test_a_rest_before_a_history_does_not_change_its_thresholds():
    """After a preload of either side; the rate of the path alone and that of the path with what went before parted."""
    posterior = made_posterior()
    posterior = replace(posterior, distortion=replace(posterior.distortion, friction_exponent=0.2, drag_exponent=0.2))
    time, torque = np.array([0.0, 600.0, 610.0, 630.0, 650.0]), np.array([0.0, 0.0, 0.1, -0.1, 0.1])
    fine = np.unique(np.r_[0.0, np.linspace(600.0, 650.0, 501)])
    for preload in (0.1, -0.1):
        rested = prediction._from(posterior, fine, np.interp(fine, time, torque), 0.01, preload)[:, 200:].mean(axis=0)
        prompt = prediction._from(posterior, fine[1:], np.interp(fine[1:], time, torque), 0.01, preload)[:, 199:].mean(axis=0)
        assert np.abs(rested - prompt).max() < 1e-3 * np.ptp(prompt)


def test_what_creeps_bends_between_points_that_lie_far_apart(monkeypatch):
    """Only the turning points are given; the planted fault follows creep straight from one to the next."""
    posterior = made_posterior()
    (creep,) = LIBRARY["viscoelastic_creep"]
    columns = creep.responses(through(np.arange(4), np.array([0.0, 0.1, -0.1, 0.1]), 0.1), None, posterior.context)[0].shape[1]
    weights = posterior.weights | {creep.name: np.full((*posterior.shape, columns), 0.02)}
    posterior = replace(posterior, weights=weights, effects=(*posterior.effects, creep))
    turns = np.array([0.0, 10.0, 30.0, 50.0])
    fine = np.linspace(0.0, 50.0, 2001)

    def at_turns(time):
        found = predict_angles(posterior, time, np.interp(time, turns, [0.0, 0.1, -0.1, 0.1]), "rest")
        return found[:, np.searchsorted(time, turns)].mean(axis=0)

    exact = at_turns(fine)
    close = np.abs(at_turns(turns) - exact).max()
    monkeypatch.setattr(prediction, "STRAIGHT", 10.0)
    assert close < 0.1 * np.abs(at_turns(turns) - exact).max() and close < 1e-4 * np.ptp(exact)


def test_what_went_before_does_not_change_thresholds(monkeypatch):
    """Thresholds follow the amplitude of what is asked: a settled small loop is the same after rest and after a full load. The
    planted fault takes the largest torque there ever was."""
    posterior = made_posterior()
    posterior = replace(posterior, distortion=replace(posterior.distortion, friction_amplitude=0.3, drag_amplitude=0.3))
    time = np.linspace(0, 60, 1201)
    torque = 0.03 * np.interp(time, np.arange(0, 61, 10), [0, 1, -1, 1, -1, 1, 0])

    def apart():
        loops = [prediction._from(posterior, time, torque, 0.005, preload)[:20, 600:1000] for preload in (np.nan, 0.1)]
        one, other = (loop - loop.mean(axis=1, keepdims=True) for loop in loops)
        return np.abs(one - other).max() / np.abs(one).max()

    assert apart() < 1e-6
    monkeypatch.setattr(prediction, "replace", lambda history, **given: history)
    assert apart() > 1e-2


def test_a_history_that_starts_under_load_and_one_that_rests_are_finite():
    time = np.linspace(0, 1, 50)
    for torque in (np.full(50, 0.05), np.linspace(0.05, -0.05, 50), np.zeros(50)):
        assert np.isfinite(predict_angles(made_posterior(), time, torque)).all()


def test_torque_beyond_what_was_measured_needs_leave():
    posterior = made_posterior()
    require_range(posterior, [0.101, -0.05], False, "x")
    with pytest.raises(BadInput, match="up to 0.1 N·m.*--extrapolate goes to 0.12.*found 0.11"):
        require_range(posterior, [0.11], False, "x")
    require_range(posterior, [0.11], True, "x")
    for absurd in (1e6, np.nan):
        with pytest.raises(BadInput, match="x: expected torques up to 0.12 N·m, 1.2 times the largest measured"):
            require_range(posterior, [absurd], True, "x")


def test_loading_rates_far_from_those_measured_are_told():
    many, lone = made_posterior(), made_posterior(loops=((0.05, 0.1), (0.051, 0.05)))
    torque = np.interp(np.arange(401), [0, 100, 300, 400], [0, 0.1, 0.1, 0])  # with a dwell, which is no rate

    def told(posterior, rate):
        return rate_caveat(posterior, np.arange(401) * 0.001 / rate, torque)

    for rate in (0.005, 0.01, 0.1, 0.25):
        assert told(many, rate) == ""
    for rate in (0.001, 1.0):
        assert f"{rate:g} N·m/s is far from those measured, 0.01 to 0.1 N·m/s" in told(many, rate)
    assert told(lone, 0.06) == ""
    assert "far from the only one measured, 0.051 N·m/s" in told(lone, 0.1)
    assert rate_caveat(many, np.arange(401), np.zeros(401)) == ""
    # One fast leg among slow ones does not drown in their mean.
    time, turning = np.r_[0.0, 2.0, 6.0, 6.1, 8.1], np.array([0.0, 0.1, -0.1, 0.1, 0.0])
    assert "loading rate of 2 N·m/s is far from" in rate_caveat(many, time, turning)


def test_rests_longer_than_all_records_are_told():
    posterior = made_posterior()
    known = max(b.end_s[-1] - b.begin_s[0] for b in posterior.records.blocks)
    torque = np.array([0.0, 0.1, 0.1, 0.1, 0.0])
    for rest, told in ((0.9 * known, ""), (1.1 * known, "s is longer than all records")):
        time = np.cumsum([0.0, 3.0 * known, 0.5 * rest, 0.5 * rest, 1.0])
        assert told in (found := rest_caveat(posterior, time, torque)) and bool(told) == bool(found)
    assert rest_caveat(posterior, [0.0, 1.0], [0.0, 0.1]) == ""
    assert rest_caveat(posterior, [0.0, 2.0 * known], [0.1, 0.1]) != ""


def test_long_histories_are_evaluated_at_nodes_that_hold_the_turning_points(monkeypatch):
    monkeypatch.setattr(prediction, "MOST_NODES", 100)
    time = np.linspace(0, 10, 5001)
    torque = np.interp(time, [0, 3.3, 5.1, 10], [0, 0.1, -0.1, 0.05])
    at = nodes(torque)
    assert at.size < 110 and {int(np.argmax(torque)), int(np.argmin(torque)), 0, 5000} <= set(at.tolist())
    rough = predict_angles(made_posterior(), time, torque, "rest").mean(axis=0)
    monkeypatch.setattr(prediction, "MOST_NODES", 10_000)
    fine = predict_angles(made_posterior(), time, torque, "rest").mean(axis=0)
    np.testing.assert_allclose(rough, fine[at], atol=1e-12)
