"""Cells against brute-force relays, and the symmetries that make the class a class."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from backdrive_bayes.mechanics.cells import START, Cells, join
from backdrive_bayes.mechanics.history import History, through
from backdrive_bayes.mechanics.reducer import ReducerClass

TORQUES = st.lists(st.floats(-1.1, 1.1).map(lambda x: round(x, 3)), min_size=3, max_size=9)
CELLS = {
    "elastic": Cells(np.array([0.2]), np.array([0.2]), np.array([0.3]), np.array([2.0])),
    "friction": Cells(np.array([0.15]), np.array([-0.05]), np.array([0.4]), np.array([2.0])),
    "clearance": Cells(np.array([0.1]), np.array([-0.3]), np.array([0.2]), np.array([0.4])),
    "flank": Cells(np.array([0.3]), np.array([0.15]), np.array([0.2]), np.array([2.0]), np.array([0.1])),
}
MANY = join(*CELLS.values())
RELAYS = 400


def path(turning, points=40):
    """Torques through ``turning``, finely stepped."""
    legs = [np.linspace(a, b, points + 1)[1:] for a, b in zip(turning[:-1], turning[1:], strict=True)]
    return np.concatenate([turning[:1], *legs])


def along(torque, seconds=None, state="neutral"):
    return replace(through(np.arange(len(torque), dtype=float) if seconds is None else seconds, torque, 1.0), state=state)


def relays(torque, up, down, width, fall, state):
    """Share of a bundle of relays that is up after every sample, each followed by itself."""
    share = (np.arange(RELAYS) + 0.5) / RELAYS
    high, low = up + share * width, down + share * fall
    middle = {"upper": low, "lower": high, "neutral": 0.5 * (high + low)}[state]
    on, found = torque[0] > middle, []
    if state == "neutral" and np.isclose(up, -down - width):
        # A clearance rests in its middle: half of its relays are up, but for those that the first torque forces.
        on = (share < 0.5) & (torque[0] > low) | (torque[0] > high)
    for value in torque[1:]:
        on = (on | (value > high)) & (value > low)
        found.append(on.mean())
    return np.array(found)


def slow(cells, torque, state):
    """The response of odd pairs as sums of relays, (samples - 1, cells)."""
    columns = []
    for up, down, width, fall, norm in zip(cells.up, cells.down, cells.width, cells.fall, cells.norm, strict=True):
        one, other = (up, down, width, fall), (-down - fall, -up - width, fall, width)
        pair = relays(torque, *one, state) + relays(torque, *other, state)
        columns.append((pair - 1.0) * width / norm)
    return np.stack(columns, axis=1)


@settings(max_examples=40, deadline=None)
@given(TORQUES, st.sampled_from(START))
def test_ends_are_those_of_single_relays(turning, state):
    torque = path(np.array(turning))
    np.testing.assert_allclose(MANY.ends(along(torque, state=state)), slow(MANY, torque, state), atol=4 * 0.4 / RELAYS)


@settings(max_examples=25, deadline=None)
@given(TORQUES, st.sampled_from(START))
def test_block_means_are_the_means_of_fine_samples(turning, state):
    turning = np.array(turning)
    coarse = along(turning, state=state)
    fine = path(turning, 800)
    brute = MANY.ends(along(fine, state=state))
    before = np.vstack([MANY.ends(along(np.r_[fine[0], fine[0]], state=state)), brute[:-1]])
    means = (0.5 * (before + brute)).reshape(turning.size - 1, 800, -1).mean(axis=1)
    np.testing.assert_allclose(MANY.means(coarse), means, atol=3e-3)


def test_a_clearance_rests_in_its_middle_whatever_the_first_torque_is():
    """Narrow cells must not tell a torque of nothing from its noise; a play operator rests at the first torque."""
    narrow = Cells(np.array([0.1]), np.array([-0.101]), np.array([0.001]), np.array([0.002]))
    starts = [narrow.ends(along(np.array([z, z]))) for z in (-5e-4, 0.0, 5e-4)]
    assert np.ptp(starts) == 0.0
    assert np.ptp([CELLS["elastic"].ends(along(np.array([z, z]))) for z in (0.3, 0.4)]) > 0.01


def test_the_mean_of_the_ends_is_no_block_mean():
    """A planted fault: one straight segment across a clearance is not half of what its end says."""
    coarse = through(np.array([0.0, 1.0]), np.array([0.0, 1.0]), 1.0)
    wrong = 0.5 * CELLS["clearance"].ends(coarse)
    assert np.abs(wrong - CELLS["clearance"].means(coarse)).max() > 0.1


def test_blocks_gather_their_segments_by_weight():
    z = np.array([0.0, 0.3, 0.5, 0.1])
    one = through(np.arange(4.0), z, 1.0)
    both = History(one.z0, one.z1, one.t0, one.t1, np.array([0, 0, 1]), np.array([0.25, 0.75, 1.0]), 2)
    single = MANY.means(one)
    np.testing.assert_allclose(MANY.means(both), np.stack([0.25 * single[0] + 0.75 * single[1], single[2]]), atol=1e-15)


@settings(max_examples=60, deadline=None)
@given(TORQUES, st.sampled_from(START))
def test_the_response_is_odd_and_its_counterpart_even(turning, state):
    torque = np.array(turning)
    swapped = {"upper": "lower", "lower": "upper", "neutral": "neutral"}[state]
    here, there = along(torque, state=state), along(-torque, state=swapped)
    for sign in (1.0, -1.0):
        for method in (MANY.means, MANY.ends):
            np.testing.assert_allclose(method(there, sign), -sign * method(here, sign), atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(TORQUES, TORQUES, st.floats(-0.9, 0.9), st.floats(-0.9, 0.9))
@example([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 0.0, 2.2250738585e-313)
def test_minor_loops_are_congruent_and_close(past, other, low, high):
    """Between the same extremes loops have one shape whatever came before, and every further round is the same."""
    loop = path(np.array([low, high, low, high, low]), 30)
    shapes = []
    for before in (past, other):
        ends = MANY.ends(along(np.r_[before, loop]))[-loop.size :]
        np.testing.assert_allclose(ends[30:61], ends[90:121], atol=1e-12)
        shapes.append(ends[60:] - ends[60])
    np.testing.assert_allclose(shapes[0], shapes[1], atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(TORQUES, st.floats(0.0, 1.0), st.lists(st.floats(0.0, 1.0), max_size=6))
def test_an_excursion_within_the_last_extremes_is_wiped_out(past, top, inner):
    """Return-point memory: back at an extreme, what happened within is forgotten."""
    past = [0.0, *past, -1.15, 1.15 * top]
    excursion = [(-1.15 + (1.15 * top + 1.15) * x) for x in inner]
    direct = MANY.ends(along(np.array([*past, 1.15])))
    detour = MANY.ends(along(np.array([*past, *excursion, 1.15 * top, 1.15])))
    np.testing.assert_allclose(detour[-1], direct[-1], atol=1e-12)
    back = MANY.ends(along(np.array([*past, *excursion, 1.15 * top])))
    np.testing.assert_allclose(back[-1], MANY.ends(along(np.array(past)))[-1], atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(TORQUES, st.integers(2, 9), st.floats(0.01, 100.0))
def test_the_operator_does_not_depend_on_the_rate(turning, points, slower):
    torque, fine = np.array(turning), path(np.array(turning), points)
    late = MANY.ends(along(fine, slower * np.arange(fine.size) ** 1.5))
    np.testing.assert_allclose(late[points - 1 :: points], MANY.ends(along(torque)), atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(TORQUES, st.integers(0, 100))
def test_no_cycle_gives_energy_back(turning, seed):
    reducer = ReducerClass(np.r_[0.0, np.geomspace(0.01, 1.2, 12)])
    cycle = np.r_[turning, turning[0]]
    history = along(np.r_[cycle, cycle[1:]])
    step, rng = (history.z1 - history.z0)[cycle.size - 1 :], np.random.default_rng(seed)
    for part in reducer.parts:
        mean = part.cells.means(history)[cycle.size - 1 :]
        weights = rng.exponential(size=part.cells.count)
        assert -step @ (mean @ weights) >= -1e-10, part.name
        if part.name in ("elastic", "free_play"):
            assert abs(step @ (mean @ weights)) < 1e-10, "what is single-valued encloses no area"


def test_a_negative_weight_can_give_energy_back():
    history = along(np.array([0.0, 1.0, -1.0, 1.0, -1.0, 1.0]))
    step = (history.z1 - history.z0)[3:]
    assert step @ CELLS["friction"].means(history)[3:, 0] < -0.05


def test_nothing_moves_before_the_torque_does():
    still = along(np.zeros(4))
    np.testing.assert_allclose(np.stack([MANY.ends(still), MANY.means(still)]), 0.0, atol=1e-15)
    full = MANY.ends(along(np.array([0.0, 1.1])))[-1]
    np.testing.assert_allclose(full, MANY.width / MANY.norm)


def test_wider_multiplies_thresholds_and_keeps_what_is_elastic():
    wide = MANY.wider(1.5)
    np.testing.assert_allclose(wide.threshold, MANY.threshold * np.array([1.0, 1.5, 1.5, 1.5]))
    np.testing.assert_allclose(wide.centre[[0, 1, 3]], MANY.centre[[0, 1, 3]])
    same = MANY.wider(1.0)
    assert all(np.allclose(getattr(same, n), getattr(MANY, n)) for n in ("up", "down", "width", "fall", "norm"))


@given(TORQUES, st.floats(0.5, 2.0))
@settings(max_examples=30, deadline=None)
def test_a_wider_clearance_is_crossed_at_torques_that_are_larger_alike(turning, factor):
    torque = np.array(turning)
    narrow, wide = CELLS["clearance"], CELLS["clearance"].wider(factor)
    np.testing.assert_allclose(wide.ends(along(factor * torque)), narrow.ends(along(torque)), atol=1e-12)


def test_relays_near_the_tip_keep_their_torques():
    knots = np.array([0.0, 0.3, 0.7, 1.0])
    cells = Cells(knots[:-1], -knots[1:], np.diff(knots), 2 * np.diff(knots))
    np.testing.assert_allclose(cells.wider(1.1).up, [0.0, 0.33, 0.7])


@pytest.mark.parametrize("name", CELLS)
def test_states_bound_the_neutral_one(name):
    torque = path(np.array([0.0, 0.15, -0.15, 0.1]))
    lower, neutral, upper = (CELLS[name].means(along(torque, state=s)) for s in ("lower", "neutral", "upper"))
    assert np.all(lower <= neutral + 1e-15) and np.all(neutral <= upper + 1e-15)
    if name == "friction":
        assert np.any(lower < upper - 1e-3), "a free initial state must make a difference"


@pytest.mark.parametrize("name", CELLS)
@pytest.mark.parametrize("state", START)
def test_thresholds_that_grow_alike_all_along_are_wider_ones(name, state):
    """Cells that rest are passed over many segments at a time."""
    torque = path(np.array([0.0, 0.9, -1.1, 0.4, -0.3, 1.0, 0.2]), 53)
    history, log_factor = along(torque, state=state), 0.2
    growing, wide = CELLS[name].grown(np.full((2, history.z0.size), log_factor)), CELLS[name].wider(np.exp(log_factor))
    # The state at first is that of thresholds that have not grown.
    moved = slice(60, None)
    np.testing.assert_allclose(growing.ends(history)[moved], wide.ends(history)[moved], atol=1e-12)
    np.testing.assert_allclose(growing.means(history)[moved], wide.means(history)[moved], atol=1e-12)


def test_thresholds_that_follow_the_rate_are_those_of_relays_at_every_moment():
    """Relays, each with a play of its own, against a cell along a path whose factor changes in every segment."""
    torque, cell = path(np.array([0.0, 0.9, -1.0, 0.5, -0.4, 1.0]), 400), CELLS["friction"]
    history = along(torque)
    factor = 1.0 + 0.3 * np.sin(np.linspace(0.0, 9.0, torque.size))
    growing = cell.grown(np.log(np.stack([factor[:-1], factor[1:]])))
    share = (np.arange(RELAYS) + 0.5) / RELAYS
    up, down = (edge[0] + cell.width[0] * share for edge in (cell.up, cell.down))
    both = [(up, down), (-down[::-1], -up[::-1])]
    states = [np.clip((2.0 * torque[0] - a - b) / (2.0 * cell.width[0]) + 0.5 > share, 0.0, 1.0) for a, b in both]
    found = np.empty(history.z1.size)
    for i, (z, more) in enumerate(zip(torque[1:], factor[1:] - 1.0, strict=True)):
        for k, (a, b) in enumerate(both):
            extra = 0.5 * (a - b) * more
            states[k] = np.where(z >= a + extra, 1.0, np.where(z <= b - extra, 0.0, states[k]))
        found[i] = sum(s.mean() for s in states) - 1.0
    settled = slice(420, None)
    np.testing.assert_allclose(growing.ends(history)[settled, 0], (found * cell.width[0] / cell.norm[0])[settled], atol=2e-3)
