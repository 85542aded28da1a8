"""Settled loops close, enclose energy, and remember turning points as Madelung's rules say."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.known import RATED, cycles, prior_values, reducer, settled_loops

from backdrive_bayes.indicators.indicators import absorbed_j, loop_area_j
from backdrive_bayes.indicators.loop import Loops, torque_grid
from backdrive_bayes.inference.discrepancy import settled_path
from backdrive_bayes.model.path import TorquePath

MODEL = reducer()
SEEDS = st.integers(0, 2**32 - 1)
SHARES = st.sampled_from([0.05, 0.1, 0.3, 0.5, 1.0, 1.2])
EXAMPLES = settings(max_examples=25, deadline=None, derandomize=True)


def tip_gap(angle, points_per_leg):
    """Distance of the last two +T tips, relative to the angle's range, per draw."""
    return np.abs(angle[:, -1] - angle[:, -1 - 2 * points_per_leg]) / np.ptp(angle, axis=1)


@given(SEEDS, SHARES)
@EXAMPLES
def test_tips_close_once_settled(seed, share):
    values = prior_values(MODEL, np.random.default_rng(seed), 40)
    angle = MODEL.angle(values, cycles(share * RATED, 2, 40))
    assert tip_gap(angle, 40).max() < 1e-9


def test_a_creeping_angle_would_not_close():
    values = prior_values(MODEL, np.random.default_rng(0), 40)
    path = cycles(RATED, 2, 40)
    angle = MODEL.angle(values, path)
    creep = 1e-6 * np.ptp(angle, axis=1)[:, None] * path.time_s / path.time_s[-1]
    assert tip_gap(angle + creep, 40).min() > 1e-9


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
def test_the_path_that_indicators_use_is_settled(share):
    grid = torque_grid(share * RATED)
    values = prior_values(MODEL, np.random.default_rng(0), 500)
    angle = MODEL.angle(values, settled_path(grid))
    assert tip_gap(angle, grid.size - 1).max() < 1e-9


@given(SEEDS, SHARES)
@EXAMPLES
def test_settled_loop_never_makes_energy(seed, share):
    grid = torque_grid(share * RATED)
    loops = settled_loops(MODEL, prior_values(MODEL, np.random.default_rng(seed), 40), grid)
    size = np.ptp(loops.rising, axis=1) * share * RATED
    assert (loops.width > -1e-12 * np.ptp(loops.rising, axis=1)[:, None]).all()
    area = loop_area_j(loops)
    assert (area >= -1e-12 * size).all()
    # Absorbed work is never less than what one cycle dissipates: u stays in [0, 1].
    assert (area <= absorbed_j(loops) * (1 + 1e-9) + 1e-12 * size).all()
    turned_round = Loops(grid, loops.falling, loops.rising)
    assert (loop_area_j(turned_round) < 0).any(), "a loop run backwards must fail this test"


@given(SEEDS, st.floats(-0.9, 0.9), st.floats(0.05, 0.95))
@EXAMPLES
def test_minor_loop_closes_and_is_forgotten(seed, at, depth):
    turn = at * RATED
    back = turn - depth * (turn + RATED)
    with_minor = TorquePath.from_turning_points(
        [0, RATED, -RATED, RATED, -RATED, turn, back, turn, RATED], 30
    )
    without = TorquePath.from_turning_points([0, RATED, -RATED, RATED, -RATED, turn, RATED], 30)
    values = prior_values(MODEL, np.random.default_rng(seed), 30)
    a, b = MODEL.angle(values, with_minor), MODEL.angle(values, without)
    size = np.ptp(b, axis=1)[:, None]
    leaves, returns = 5 * 30, 7 * 30
    assert (np.abs(a[:, returns] - a[:, leaves])[:, None] < 1e-9 * size).all()
    assert (np.abs(a[:, returns:] - b[:, leaves:]) < 1e-9 * size).all()
    inside = a[:, leaves : returns + 1]
    assert (np.ptp(inside, axis=1) > 0).all(), "the minor loop must move for this test to mean something"


def test_a_minor_loop_that_is_not_closed_leaves_its_mark():
    open_loop = TorquePath.from_turning_points(
        [0, RATED, -RATED, RATED, -RATED, 0.5 * RATED, 0.0, 0.02 * RATED], 30
    )
    straight = TorquePath.from_turning_points([0, RATED, -RATED, RATED, -RATED, 0.02 * RATED], 30)
    values = prior_values(MODEL, np.random.default_rng(1), 30)
    gap = MODEL.angle(values, open_loop)[:, -1] - MODEL.angle(values, straight)[:, -1]
    assert np.median(np.abs(gap)) > 1e-6 * 0.02
