"""The class: parts, modules, knots, thresholds, and columns that are those of its cells."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.cells import Cells
from backdrive_bayes.mechanics.clearance import place_knots, spaced
from backdrive_bayes.mechanics.friction import FRICTION, THRESHOLDS, flank, plays, principal_components
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.part import TOP
from backdrive_bayes.mechanics.reducer import BASELINE, GROWTH_STEPS, ReducerClass

KNOTS = np.r_[0.0, np.geomspace(0.01, TOP, 20)]
REDUCER = ReducerClass(KNOTS)


def ramp(*turning, points=200):
    torque = np.concatenate([np.linspace(a, b, points) for a, b in zip(turning[:-1], turning[1:], strict=True)])
    return through(np.arange(torque.size, dtype=float), torque, 1.0)


def test_columns_are_linear_in_the_cells():
    history = ramp(0.0, 1.0, -1.0)
    columns = REDUCER.columns(history)
    rng = np.random.default_rng(0)
    for part in REDUCER.parts:
        independent = rng.standard_normal(columns[part.name].shape[1])
        np.testing.assert_allclose(
            columns[part.name] @ independent, part.cells.means(history) @ part.weights(independent), atol=1e-9
        )


def test_the_prior_of_every_part_has_its_covariance_from_mixing():
    for part in REDUCER.parts:
        if part.mixing is not None and part.name not in FRICTION:
            assert np.linalg.eigvalsh(part.mixing @ part.mixing.T).min() > 0
            assert np.array_equal(part.mixing, np.tril(part.mixing))


def test_friction_has_the_loops_of_its_prior_with_fewer_weights():
    """On a path that was not used to tell its weights apart; half of the weights are not enough (planted fault)."""
    cells, root = plays(THRESHOLDS)
    history, mixing = ramp(0.0, -0.9, 0.6, -0.4, 0.3, -0.9, 0.9), principal_components(cells, root)
    whole, fewer, half = (np.sum((cells.ends(history) @ m) ** 2) for m in (root, mixing, mixing[:, : mixing.shape[1] // 2]))
    assert mixing.shape[1] < 0.4 * cells.count
    assert whole - fewer < 1e-5 * whole < whole - half




def alike(knots, edges=(0.06, 0.1, 0.16)):
    """Prior correlation of what clearance crosses between the first two of the torques and between the last two."""
    part = ReducerClass(knots).part("clearance")
    first, middle, last = np.searchsorted(knots, edges)
    one, other = part.mixing[first:middle].sum(axis=0), part.mixing[middle:last].sum(axis=0)
    return one @ other / (np.linalg.norm(one) * np.linalg.norm(other))


def test_steps_nearby_are_alike_however_dense_the_knots():
    """The prior is one of the loop, not of its knots: twice as many leave neighbouring stretches as alike as they were."""
    coarse = np.r_[0.0, np.geomspace(0.01, TOP, 40)]
    fine = np.sort(np.r_[coarse, 0.5 * (coarse[1:] + coarse[:-1])])
    assert alike(coarse) == pytest.approx(alike(fine), abs=0.05)
    assert alike(coarse) > 0.4 > alike(coarse, (0.01, 0.02, 1.0)) and alike(coarse) < 0.98


def test_every_part_answers_up_to_full_load():
    """Read-outs that end below the largest torque made clean loops seem to slip."""
    history = through(np.arange(4.0), np.array([0.0, -TOP, 0.999, 1.0]), 1.0)
    for name, ends in REDUCER.ends(history).items():
        assert np.abs(ends[2] - ends[1]).max() > 1e-5, name


@pytest.mark.parametrize("modules", [("elastic",), ("elastic", "friction"), BASELINE])
def test_modules_choose_the_parts(modules):
    reducer = ReducerClass(KNOTS, modules)
    assert {p.module for p in reducer.parts} == set(modules)
    assert set(reducer.columns(ramp(0.0, 1.0))) == {p.name for p in reducer.parts}


@pytest.mark.parametrize("modules", [("friction",), ("elastic", "magic"), ()])
def test_unknown_modules_and_none_that_is_elastic_are_refused(modules):
    with pytest.raises(BadInput, match="baseline"):
        ReducerClass(KNOTS, modules)


def test_thresholds_grow_each_by_its_own_logarithm():
    history = ramp(0.0, 1.0, -1.0, 1.0)
    base, same = REDUCER.columns(history), REDUCER.columns(history, (0.0, 0.0, 0.0))
    assert all(np.array_equal(base[n], same[n]) for n in base)
    wider = REDUCER.columns(history, (0.2, 0.0, 0.0))
    assert not np.allclose(wider["friction"], base["friction"])
    assert all(np.array_equal(wider[n], base[n]) for n in ("elastic", "clearance", "free_play"))
    drag = REDUCER.columns(history, (0.0, 0.2, 0.0))
    assert not np.allclose(drag["clearance"], base["clearance"]) and np.array_equal(drag["friction"], base["friction"])


@pytest.mark.parametrize("moves", [False, True])
def test_a_drag_at_the_shaft_is_a_play_before_the_whole_reducer(moves):
    """On every part; one that multiplied their thresholds would leave elasticity as it is (planted fault)."""
    history = ramp(0.0, 1.0, -1.0, 0.3, -0.2, 1.0)
    drag = 0.06 + 0.04 * np.sin(np.linspace(0.0, 20.0, history.z1.size + 1)) * moves
    behind = [0.0]
    for z, most in zip(history.z1, drag[1:], strict=True):
        behind.append(min(max(behind[-1], z - most), z + most))
    before = np.stack([drag[:-1], drag[1:]]) if moves else float(drag[0])
    dragged = REDUCER.ends(history, (0.0, 0.0, before))
    felt = REDUCER.ends(replace(history, z0=np.array(behind[:-1]), z1=np.array(behind[1:])))
    for name, column in dragged.items():
        np.testing.assert_allclose(column[200:], felt[name][200:], atol=1e-9, err_msg=name)
    assert not np.allclose(dragged["elastic"], REDUCER.ends(history, (0.2, 0.2, 0.0))["elastic"], atol=1e-2)


def test_growth_along_a_history_that_is_everywhere_the_same_is_that_growth():
    """The moving switching torques against cells that are wider once and for all; a growth that moves is another one."""
    history = ramp(0.0, 1.0, -1.0, 1.0)
    along = [np.full((2, history.z1.size), g) for g in (0.3, -0.2, 0.01)]
    for state in ("neutral", "upper"):
        # Of a record that begins at a tip, too.
        began = replace(history, state=state) if state == "neutral" else replace(ramp(1.0, -1.0, 1.0), state=state)
        grown = [g[:, : began.z1.size] for g in along]
        for columns in (REDUCER.columns, REDUCER.ends):
            one, other = columns(began, (0.3, -0.2, 0.01)), columns(began, grown)
            assert all(np.allclose(one[n], other[n], atol=1e-12) for n in one)
    moving, other = (REDUCER.columns(history, [g * by for g in along]) for by in (np.linspace(0.0, 1.0, history.z1.size), 1.0))
    assert not np.allclose(moving["friction"], other["friction"], atol=1e-3)


@pytest.mark.parametrize("moves", [False, True])
def test_growth_has_its_own_derivatives(moves):
    """Against much wider difference quotients, at a growth that is not zero."""
    history = ramp(0.0, 1.0, -1.0, 1.0)
    term = np.stack([np.linspace(-1.0, 1.5, history.z1.size)] * 2) if moves else 0.8
    growth = (0.1 * term, -0.1 * term, 0.02 + 0.01 * term)
    weights = {p.name: np.ones(p.cells.count if p.mixing is None else p.mixing.shape[1]) for p in REDUCER.parts}

    def angle(*grown):
        columns = REDUCER.columns(history, grown)
        return sum(columns[n] @ weights[n] for n in columns)

    for part, step in enumerate((0.03, 0.03, 0.003)):
        (found,) = REDUCER.grown(history, weights, growth, part, [term])
        more, less = (angle(*(g + sign * step * term * (k == part) for k, g in enumerate(growth))) for sign in (1, -1))
        wide = (more - less) / (2 * step)
        assert np.sqrt(np.mean((found - wide) ** 2)) < 0.15 * np.abs(wide).max() and np.abs(wide).max() > 0


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize(("part", "spread"), [(0, 0.4), (1, 0.4), (2, 0.01)])
def test_growths_of_draws_are_those_of_the_thresholds(part, spread, moves):
    """Where a step is crossed the derivative, the planted fault, leads to spikes; no drag helps the motion. Of many draws the 5 %
    farthest are as near (planted fault: seven quantiles that are equally far apart)."""
    history, growth = ramp(0.0, 1.0, -1.0, 1.0), (0.1, -0.1, 0.0)
    term = np.stack([np.linspace(0.5, 1.5, history.z1.size)] * 2) if moves else 0.8
    rng = np.random.default_rng(1)
    weights = {p.name: rng.standard_normal(p.cells.count if p.mixing is None else p.mixing.shape[1]) for p in REDUCER.parts}
    shifts = spread * rng.standard_normal(9)

    def angle(shift):
        grown = (g + shift * term * (k == part) for k, g in enumerate(growth))
        columns = REDUCER.ends(history, tuple(np.maximum(g, 0.0) if k == 2 else g for k, g in enumerate(grown)))
        return sum(columns[n] @ weights[n] for n in columns)

    exact = np.stack([angle(shift) for shift in shifts]) - angle(0.0)
    derivative = (angle(GROWTH_STEPS[part]) - angle(0.0)) / GROWTH_STEPS[part]
    found = REDUCER.shifted(history, weights, growth, part, shifts, term)
    assert np.abs(found - exact).max() < 0.3 * np.abs(np.outer(shifts, derivative) - exact).max()
    many = spread * rng.standard_normal(400)
    far = np.sort(np.argsort(many)[[20, -20]])
    ends = REDUCER.shifted(history, weights, growth, part, many, term)[far]
    exact_ends = np.stack([angle(shift) for shift in many[far]]) - angle(0.0)
    assert np.abs(ends - exact_ends).max() < 0.2 * np.abs(exact_ends).max()
    few = REDUCER.shifted(history, weights, growth, part, shifts[:3], term)
    np.testing.assert_allclose(few, exact[:3], atol=1e-9 * np.abs(exact).max())
    assert not REDUCER.shifted(history, weights, growth, part, np.zeros(2), term).any()


def test_denser_thresholds_leave_the_prior_of_the_loop_as_it_is():
    """Width of the largest loop at zero torque that friction has a priori; with weights as wide as on the first grid more
    thresholds would make it larger (planted fault)."""
    history = ramp(0.0, 1.0, -1.0, 1.0)
    dense = np.sort(np.r_[THRESHOLDS, np.sqrt(THRESHOLDS[1:] * THRESHOLDS[:-1])])

    def width(cells, root):
        ends = cells.ends(history) @ root
        falling, rising = (199 + int(np.argmin(np.abs(history.z1[leg : leg + 199]))) + leg - 199 for leg in (199, 398))
        return np.linalg.norm(ends[falling] - ends[rising])

    usual, more = (width(*plays(t)) for t in (THRESHOLDS, dense))
    assert more == pytest.approx(usual, rel=0.1)
    cells, root = plays(dense)
    level = np.sqrt(np.sum(root**2, axis=1))
    assert width(cells, root * (level.max() / level)[:, None]) > 1.3 * usual


def coulomb(torque, ratio):
    """Load that passes a flank with friction in proportion to it, from rest: it rests between the edges of the friction cone."""
    load, found = 0.0, []
    for low, high in (sorted((z, z / ratio)) for z in torque):
        load = min(max(load, low), high)
        found.append(load)
    return np.array(found)


@pytest.mark.parametrize("ratio", [0.3, 0.48, 0.9])
def test_a_flank_with_friction_in_proportion_to_its_load_is_held_at_every_amplitude(ratio):
    """A play of fixed threshold (planted fault) bends elsewhere in a smaller loop."""
    history = ramp(0.0, 1.0, -1.0, 1.0, -1.0, 0.4, -0.4, 0.4)
    cells, _ = flank(ratio)
    truth = coulomb(history.z1, ratio)
    np.testing.assert_allclose(2.0 * cells.ends(history).sum(axis=1), truth, atol=1e-12)
    threshold = Cells(*(np.array([v]) for v in (-TOP, -TOP - (1 - ratio), 2 * TOP, 2.0))).ends(history)
    fit = threshold @ np.linalg.lstsq(threshold, truth)[0]
    assert np.abs(fit - truth).max() > 0.05


def test_a_flank_that_slips_back_beyond_zero_does_so_in_proportion_to_its_load():
    """After a smaller load the torque that turns it back is smaller."""
    cells, ratio = flank(-0.2)[0], -0.2
    for amplitude in (1.0, 0.5):
        history = ramp(0.0, amplitude, -1.0)
        back = history.z1[200:][np.flatnonzero(np.diff(cells.ends(history)[200:].sum(axis=1)) < -1e-4)]
        released = back[back > ratio * amplitude - 0.03]
        assert released.size and released.max() < 0.01
        assert cells.up[0] == 0.0 and np.all(cells.down + cells.fall <= 1e-12)


@pytest.mark.parametrize("growth", [0.3, -0.3])
@pytest.mark.parametrize("ratio", [0.48, 0.015, -0.02])
def test_growth_of_a_flank_along_a_history_is_that_of_all_its_thresholds(growth, ratio):
    cells, history = flank(ratio)[0], ramp(0.0, 1.0, -1.0, 0.4, -0.4, 1.0)
    along = cells.grown(np.full((2, history.weight.size), growth))
    np.testing.assert_allclose(along.ends(history), cells.grown(growth).ends(history), atol=1e-12)
    np.testing.assert_allclose(along.means(history), cells.grown(growth).means(history), atol=1e-12)
    varying = cells.grown(growth * np.stack([np.linspace(-1.0, 1.0, history.weight.size)] * 2))
    mirrored = replace(history, z0=-history.z0, z1=-history.z1)
    np.testing.assert_allclose(varying.ends(mirrored), -varying.ends(history), atol=1e-12)


def test_flanks_that_differ_are_even_in_the_torque():
    rng = np.random.default_rng(1)
    weights = {n: rng.standard_normal(c.shape[1]) for n, c in REDUCER.columns(ramp(0.0, 1.0)).items()}
    here, there = (REDUCER.flank_columns(ramp(0.0, s, -s, s), weights) for s in (1.0, -1.0))
    np.testing.assert_allclose(there, here, atol=1e-10)
    ends = REDUCER.flank_columns(ramp(0.0, 1.0), weights, ends=True)
    assert ends.shape == (199, len(REDUCER.parts)) and np.abs(here).max() > 0.01


def test_knots_are_dense_where_blocks_are_and_keep_their_distance():
    torques = np.r_[np.linspace(-1, 1, 50), np.linspace(0.04, 0.06, 200)]
    knots = place_knots(torques, 60, 1e-4)
    assert knots[0] == 0.0 and knots[-1] == TOP and np.all(np.diff(knots) >= 1e-4)
    inside = np.sum((knots > 0.04) & (knots < 0.06))
    assert inside > 0.7 * knots.size
    assert place_knots(torques, 60, 0.01).size < knots.size


def test_a_loop_that_bends_near_zero_torque_keeps_its_width_there():
    """No block lies nearer to zero than 0.006; relays that cross nearer are held, and not without the halved knots."""
    torques = np.r_[np.linspace(0.006, 0.03, 200), np.linspace(0.03, 1.0, 60)]
    knots = place_knots(torques, 60, 2e-4)
    coarse = knots[(knots == 0.0) | (knots >= 0.006)]
    assert width_error_at_zero(coarse) > 0.1 and width_error_at_zero(knots) < 0.02


def width_error_at_zero(knots):
    """Of the best loop of the class against clearance that is crossed between 0.0015 and 0.004, as a share of it."""
    near = np.linspace(-0.01, 0.01, 201)
    torque = np.r_[0.0, 1.0, near[::-1], -1.0, near, 1.0]
    history = through(np.arange(torque.size + 0.0), torque, 1.0)
    reducer = ReducerClass(knots)
    columns = np.hstack([reducer.part(name).cells.ends(history) for name in ("clearance", "free_play")])
    truth = Cells(*(np.array([v]) for v in (0.0015, -0.004, 0.0025, 0.005))).ends(history)[:, 0]
    settled = slice(1, None)
    fit = columns @ np.linalg.lstsq(columns[settled], truth[settled], rcond=None)[0]
    falling, rising = (np.flatnonzero(np.abs(history.z1[settled]) < 1e-12) + 1)[[0, -1]]
    return abs((fit - truth)[falling] - (fit - truth)[rising])


def test_spaced_keeps_both_ends():
    found = spaced(np.array([0.0, 0.001, 0.1, 0.15, 0.2, 1.2]), 0.08)
    np.testing.assert_allclose(found, [0.0, 0.1, 0.2, 1.2])


def test_loops_do_not_bend_at_their_tips():
    """What is turned per torque above the last knot is what is turned below it (planted fault: a step that reaches to TOP)."""
    knots = place_knots(np.linspace(0.0, 0.99, 400), 60, 1e-4)
    reducer = ReducerClass(knots)
    time = np.linspace(0.0, 5.0, 2001)
    history = through(time, np.interp(time, [0, 1, 2, 3, 4, 5], [0, 1, -1, 1, -1, 1.0]), 1.0)
    cells = reducer.part("free_play").cells
    turned = cells.ends(history)[-401:] @ np.diff(np.minimum(knots, 1.0))
    slope = np.diff(turned) / np.diff(history.z1[-401:])
    top = history.z1[-400:] > knots[-2]
    assert knots[-2] < 0.97 and slope[top].mean() == pytest.approx(slope[(history.z1[-400:] > 0.5) & ~top].mean(), rel=0.05)
    assert (cells.norm[-1] / cells.width[-1]) == pytest.approx((1.0 - knots[-2]) / (TOP - knots[-2]))


def test_a_stiff_tip_is_not_cut_by_friction_too_fine_to_be_told():
    """A unit's compliance costs the prior nothing as a constant, and a fortune as friction of the smallest thresholds, which
    would hold the loop still at its tips."""
    parts = {p.name: p for p in REDUCER.parts}
    assert parts["compliance"].log_scale == (0.0, 0.0)
    up = REDUCER.ends(ramp(0.0, 1.0))["compliance"][:, 0]
    # One weight is half of the angle scale at the torque scale, and back on the same line.
    assert up[-1] == pytest.approx(0.5, abs=1e-12)
    back = REDUCER.ends(ramp(0.0, 1.0, 0.0))["compliance"][:, 0]
    assert back[-1] == pytest.approx(0.0, abs=1e-12)
