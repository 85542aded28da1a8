"""Torque histories behind the blocks of a record: means, turning points, offset and lag."""

import numpy as np
import pytest
from support.bench import path_of
from support.planted import by_hand, smooth_reducer

from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.mechanics import history as module
from backdrive_bayes.mechanics.friction import FRICTION
from backdrive_bayes.mechanics.history import of_blocks, through
from backdrive_bayes.records.reduction import Blocks, loading_rate

SCALE, RATE = 0.1, 0.05
TURNING = np.array([0.0, 0.1, -0.1, 0.1])


def ramped(per_leg=7) -> Blocks:
    """Blocks of 0 → +T → −T → +T at a constant rate."""
    edges = [np.linspace(a, b, per_leg + 1) for a, b in zip(TURNING[:-1], TURNING[1:], strict=True)]
    time = np.r_[0.0, np.cumsum(np.concatenate([np.abs(np.diff(e)) for e in edges]))] / RATE
    torque = np.concatenate([0.5 * (e[1:] + e[:-1]) for e in edges])
    small = np.zeros(torque.size)
    return Blocks(
        "ramp", torque, small, small, time[:-1], time[1:], np.full(torque.size, 50), np.repeat([0, 1, 2], per_leg), TURNING,
        np.array([1, -1, 1]), small, **path_of(time[:-1], time[1:], np.repeat([0, 1, 2], per_leg), torque, TURNING),
    )  # fmt: skip


def middle(history):
    """Mean torque of every block."""
    return history.mean(history.z0[:, None], history.z1[:, None])[:, 0]


def test_the_mean_torque_of_a_block_is_the_one_that_was_read():
    blocks = ramped()
    history = of_blocks(blocks, SCALE)
    np.testing.assert_allclose(middle(history), blocks.torque_nm / SCALE, atol=1e-12)
    # A knot of the path in the middle of a block cuts it in two.
    assert history.z0.size == 2 * blocks.count.size and history.blocks == blocks.count.size


def test_weights_of_a_block_sum_to_one():
    for lag in (0.0, 0.3):
        history = of_blocks(ramped(), SCALE, lag_s=lag)
        np.testing.assert_allclose(np.bincount(history.block, history.weight), 1.0)


def test_an_offset_is_added_to_what_was_read():
    still = of_blocks(ramped(), SCALE)
    moved = still.beside(0.02)
    np.testing.assert_allclose(moved.z1 - still.z1, 0.02)
    assert moved.start == pytest.approx(0.02)


@pytest.mark.parametrize("lag", [-0.05, 0.05])
def test_a_late_angle_answers_an_earlier_torque(lag):
    blocks = ramped()
    late = middle(of_blocks(blocks, SCALE, lag_s=lag))
    expected = (blocks.torque_nm - lag * RATE * blocks.direction[blocks.leg]) / SCALE
    away = np.abs(np.abs(blocks.torque_nm) - 0.1) > 0.02
    away[0] = False
    np.testing.assert_allclose(late[away], expected[away], atol=1e-12)
    assert np.abs(late - blocks.torque_nm / SCALE)[away].min() > 0.02


@pytest.mark.parametrize("lag", [0.0, 0.031])
def test_turning_points_are_kept(lag):
    history = of_blocks(ramped(), SCALE, lag_s=lag)
    assert history.z1.max() == pytest.approx(1.0) and history.z1.min() == pytest.approx(-1.0)
    turned = np.flatnonzero(np.diff(np.sign(history.z1 - history.z0)) != 0)
    assert np.isin(np.round(history.z1[turned], 12), [1.0, -1.0]).all()


def test_segments_join():
    history = of_blocks(ramped(), SCALE, 0.02).beside(0.01)
    assert np.array_equal(history.z0[1:], history.z1[:-1]) and np.array_equal(history.t0[1:], history.t1[:-1])
    assert np.all(history.t1 > history.t0) and np.all(np.diff(history.block) >= 0)


def test_samples_are_blocks_of_their_own():
    history = through([0.0, 1.0, 3.0], [0.0, 0.1, -0.1], SCALE)
    np.testing.assert_allclose(middle(history), [0.5, 0.0], atol=1e-15)
    assert history.start == 0.0 and history.blocks == 2


def test_a_rest_where_the_torque_turns_is_no_loading():
    """Planted fault: the mean over all of the time."""
    time, torque = np.array([0.0, 9.0, 10.0, 13.0, 15.0, 18.0, 20.0]), np.array([0.0, 0.0, 1.0, 1.0, -1.0, -1.0 + 1e-6, 1.0])
    assert loading_rate(time, torque) == pytest.approx(1.0)
    assert abs(np.abs(np.diff(torque)).sum() / time[-1] - 1.0) > 0.5
    stairs = np.array([0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 2.0])
    assert loading_rate(np.arange(8.0), stairs) == pytest.approx(4.0 / 6.0)
    assert loading_rate(np.arange(3.0), np.ones(3)) == 0.0
    # A tick of the noise between a leg and its rest makes no loading of the rest.
    for tick in (1e-3, -1e-3):
        ticked = np.array([0.0, 0.0, 1.0 - tick, 1.0, 1.0, -1.0, -1.0 + 1e-6, 1.0])
        when = np.array([0.0, 9.0, 9.999, 10.0, 13.0, 15.0, 18.0, 20.0])
        assert loading_rate(when, ticked) == pytest.approx(1.0, rel=0.01)
    turned = -stairs[::-1]
    assert loading_rate(np.arange(8.0), turned) == loading_rate(np.arange(8.0), stairs)
    long = np.r_[-1e5, time[1:]]
    np.testing.assert_allclose(through(long, torque, 1.0).surge[:, 1:], through(time, torque, 1.0).surge[:, 1:])


def test_thresholds_that_follow_the_rate_are_followed_where_it_bends(monkeypatch):
    """Straight pieces between the bends of the rate against fifty times as many; without cuts at the bends much is lost."""
    known = smooth_reducer()
    blocks = reduce_unit(by_hand(0.4, known), 40).blocks[0]

    def angles(cuts=None):
        with monkeypatch.context() as patch:
            if cuts is not None:
                patch.setattr(module, "_bends", lambda time_s, z, usual: cuts)
            history = of_blocks(blocks, SCALE)
        parts = (p.cells.grown(0.4 * history.surge) if p.name in FRICTION else p.cells for p in known.reducer.parts)
        return sum(c.summed(history, known.weights[p.name]) for c, p in zip(parts, known.reducer.parts, strict=True))

    exact = angles(np.linspace(blocks.begin_s[0], blocks.end_s[-1], 50 * blocks.count.size))
    lost, left = (np.abs(found - exact).max() for found in (angles(np.empty(0)), angles()))
    assert left < 0.2 * lost and left < 2e-4 * np.ptp(exact)
