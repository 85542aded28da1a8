"""Where a gap lies and how far a name closes it on held-out data."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from support.planted import joint_mode, planted, prepared, smooth_reducer, stepped

from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.gap import examine, next_test, where
from backdrive_bayes.gap.averaged import weighed_unit
from backdrive_bayes.gap.shrink import Shrink, _alone, closed_fraction, fit_hypothesis, shrink, within_reach
from backdrive_bayes.mechanics.registry import library_terms
from backdrive_bayes.records.reduction import loading_rate


@cache
def gap_of(name):
    linear = prepared(name)[0]
    return linear, where.estimate_gap(linear, np.random.default_rng(0))


def shrunk(unit, name):
    linear, gap = gap_of(unit)
    before, after = (fit_hypothesis(linear, h, levels(linear, h)) for h in ((), (name,)))
    return shrink(before, after, gap.weight, np.random.default_rng(1))


def closed(unit, name):
    return shrunk(unit, name).closed("after", np.random.default_rng(0), 0.9)


def test_the_closed_fraction_lies_within_its_own_interval():
    """A model misses what is held out by nearly twice as much as it says. The planted fault takes no error of prediction for the
    fraction itself, which then lies below all that are resampled."""
    rng, pieces = np.random.default_rng(0), 24
    error = 0.4 * rng.chisquare(4, (400, pieces)) / 4
    left = 1.7 + 0.1 * rng.standard_normal(pieces)
    parts = {"share": np.ones(pieces), "before": 9.0 * np.ones(pieces), "floor": np.ones(pieces), "after": left, "control": left}
    fold, found = np.repeat([0, 1, 2], 8), []
    for first in (error.mean(axis=0), np.zeros(pieces)):
        held = Shrink(("a", "b", "c"), fold, error=np.concatenate([[first], error]), **parts)
        found.append(held.closed("after", np.random.default_rng(0), 0.9))
    assert found[0]["lo"] < found[0]["median"] < found[0]["hi"]
    assert found[1]["median"] == found[1]["lo"] < found[0]["lo"]


@pytest.mark.parametrize("name", ["unknown", "asymmetric_stiffness"])
def test_shares_sum_to_one(name):
    cells = where.gap_map(*gap_of(name))
    assert sum(c["share"] for c in cells) == pytest.approx(1.0) and min(c["share"] for c in cells) >= 0
    assert {c["branch"] for c in cells} == set(where.BRANCHES) and len({c["record"] for c in cells}) == 2
    assert all(-0.1001 <= c["torque_lo_Nm"] < c["torque_hi_Nm"] <= 0.1001 for c in cells)


def test_a_step_in_one_record_lies_in_that_record():
    """With one scale of the process for all records, a fifth of it is shared out among the other (planted fault)."""
    linear = weighed_unit(stepped(3e-3)).of(())
    cells, blocks = where.gap_map(linear, where.estimate_gap(linear, np.random.default_rng(0))), linear.reduced.blocks
    first = blocks[0].name
    assert sum(c["share"] for c in cells if c["record"] == first) > 0.95
    assert any(c["credible"] for c in cells)
    assert first in where.summary(cells, {b.name: 0.1 for b in blocks})


@pytest.mark.parametrize(
    ("before", "named", "shown"),
    [((1.2, 9.0), ("geometric",), "b"), ((9.0, 9.5), (), ""), ((1.0, 3.9), ("geometric",), "")],
)
def test_a_gap_to_which_the_fit_bends_shows_in_what_is_left_out(before, named, shown):
    """The record in which it is clearest; none where nothing is named or none is clear (planted faults)."""
    held = SimpleNamespace(names=("a", "b"), clear_of_noise=lambda fold: before[fold])
    assert examine.Found.shown_left_out.fget(SimpleNamespace(held_out=held, named=named)) == shown
    cells = [{"credible": False}]
    assert (f"it does in {shown}, as predicted" in where.summary(cells, {}, shown)) is bool(shown)
    assert "Nowhere" in where.summary(cells, {}, shown)
    assert ("takes up" in where.summary(cells, {}, shown, named=True)) is not bool(shown)


def test_what_is_even_lies_at_high_torque_of_either_sign_in_both_records():
    cells = where.gap_map(*gap_of("asymmetric_stiffness"))
    share = {b: sum(c["share"] for c in cells if c["branch"].endswith(b)) for b in "+-"}
    # One settled leg of each direction tells how it is shared: not in halves, but at either sign.
    assert 0.2 < share["+"] < 0.8
    high = sum(c["share"] for c in cells if max(abs(c["torque_lo_Nm"]), abs(c["torque_hi_Nm"])) > 0.061)
    assert high > 0.55
    for blocks in gap_of("asymmetric_stiffness")[0].reduced.blocks:
        assert sum(c["share"] for c in cells if c["record"] == blocks.name) > 0.3


def test_a_clean_unit_has_no_gap():
    clean, even = gap_of("none")[1], gap_of("asymmetric_stiffness")[1]
    assert clean.rms_rad < clean.noise_rad < 0.3 * even.rms_rad


@pytest.mark.parametrize(("unit", "name"), [("asymmetric_stiffness", "asymmetric_stiffness"), ("thermal_drift", "thermal_drift")])
def test_the_right_name_closes_the_gap(unit, name):
    found = closed(unit, name)
    assert found["lo"] <= found["median"] <= found["hi"] and found["median"] > 0.75 and found["hi"] > 0.9


WRONG = [("asymmetric_stiffness", "torque_offset"), ("thermal_drift", "torque_offset"), ("unknown", "asymmetric_stiffness")]


@pytest.mark.parametrize(("unit", "name"), WRONG)
def test_a_wrong_name_closes_nothing(unit, name):
    found = closed(unit, name)
    assert found["median"] < 0.1 and found["lo"] <= 0.01 and found["hi"] < examine.LEAST_CLOSED


def test_a_right_name_keeps_its_interval_above_half_shownother_records_tell_little():
    """One settled loop at each of two rates: the prediction from the other record is wide, whatever the name."""
    for seed in range(3):
        unit = planted(seed, known=smooth_reducer(), offset_nm=8e-4)
        linear = joint_mode(reduce_unit(unit), library_terms())
        before, after = (fit_hypothesis(linear, h, levels(linear, h)) for h in ((), ("torque_offset",)))
        weight = where.estimate_gap(linear, np.random.default_rng(0)).weight
        held = shrink(before, after, weight, np.random.default_rng(1))
        found, none = (s.closed("after", np.random.default_rng(0), 0.9) for s in (held, replace(held, error=0.0 * held.error)))
        assert found["hi"] > 0.9 and found["hi"] >= none["hi"] and found["median"] >= none["median"]


def test_a_property_is_in_the_class_before_and_after():
    """Nothing is added, so nothing could close: there is no fraction, and no reason to call the name unknown."""
    inside, added = (shrunk("asymmetric_stiffness", n) for n in ("second_backlash", "asymmetric_stiffness"))
    np.testing.assert_allclose(inside.after, inside.before)
    def of(named, held_out):
        inside_class, rng = (SimpleNamespace(name="second_backlash"),), np.random.default_rng(0)
        found = SimpleNamespace(named=named, held_out=held_out, properties=inside_class, rng=rng)
        return examine.Found.closed_of(found)

    assert of(("second_backlash",), inside) is None
    assert of(("asymmetric_stiffness", "second_backlash"), added)["median"] > 0.75
    assert of((), inside)["hi"] == 0.0


def test_what_no_other_record_tells_is_fitted_to_the_record_that_is_held_out():
    """The drift of a record and the states of creep at its beginning, of two records; nothing of the class."""
    linear = prepared("none")[0]
    alone = _alone(linear, 0)
    names = np.array(linear.design.names)[linear.design.index]
    assert set(names[alone]) == {"thermal_drift", "viscoelastic_creep"}
    drift, creep = names == "thermal_drift", names == "viscoelastic_creep"
    assert 2 * alone[drift].sum() == drift.sum() and alone[creep].sum() == 4


def test_held_out_records_are_every_record_in_turn():
    found = shrunk("asymmetric_stiffness", "asymmetric_stiffness")
    assert found.names == tuple(b.name for b in gap_of("asymmetric_stiffness")[0].reduced.blocks)
    assert {int(f) for f in found.fold} == {0, 1}
    np.testing.assert_allclose([found.share[found.fold == f].sum() for f in (0, 1)], 1.0)
    assert found.mean_square("after") < found.mean_square("before")


def run_at(rates, amplitudes):
    """What `within_reach` sees of a unit with records of these rates and amplitudes."""
    blocks = [SimpleNamespace(turning_nm=np.array([0.0, a, -a, a])) for a in amplitudes]
    return SimpleNamespace(reduced=SimpleNamespace(context=SimpleNamespace(rate=np.array(rates)), blocks=blocks))


@pytest.mark.parametrize(
    ("rates", "amplitudes", "folds"),
    [
        ((1.0, 3.0, 9.0), (1.0, 1.0, 1.0), [1]),
        ((1.0, 1.02, 0.99), (1.0, 1.0, 1.0), [0, 1, 2]),
        ((1.0, 1.0, 1.0), (1.0, 0.5, 0.7), [1, 2]),
        ((1.0, 9.0), (1.0, 1.0), []),
        ((1.0, 1.0, 9.0, 9.0), (1.0, 1.01, 1.0, 0.4), [0, 1, 2, 3]),
    ],
)
def test_records_within_reach_are_no_slower_faster_or_larger_than_the_others(rates, amplitudes, folds):
    assert within_reach(run_at(rates, amplitudes)) == folds


@pytest.mark.parametrize(
    ("turning", "settled", "folds"),
    [
        ((-1.0, 1.0), (0,), []),
        ((0.0, 1.0, -1.0, 1.0), (1, 2), []),
        ((0.0, 1.0, -1.0, 1.0, -1.01), (1, 2, 3), [0, 2]),
        ((0.0, 1.0, -1.0, 1.0, -1.0, 1.0), (1, 2, 3, 4), [0, 1, 2, 3]),
        # A short leg is seen by a long one, not the other way round.
        ((0.0, 1.0, -1.0, 1.0, 0.0), (1, 2, 3), [2]),
    ],
)
def test_a_leg_of_one_record_is_within_reach_of_another_that_runs_over_it(turning, settled, folds):
    turning = np.array(turning)
    leg = np.repeat(np.arange(turning.size - 1), 3)
    blocks = SimpleNamespace(leg=leg, turning_nm=turning, direction=np.sign(np.diff(turning)))
    reduced = SimpleNamespace(context=SimpleNamespace(rate=np.ones(1)), blocks=[blocks], settled=[np.isin(leg, settled)])
    assert within_reach(SimpleNamespace(reduced=reduced)) == folds


def repeated(unit, cycles):
    """The unit with the cycle of its one record, which are its last four fifths, run several times."""
    (record,) = unit.records
    every = np.arange(record.time_s.size)
    run = np.r_[every, np.tile(every[every.size // 5 + 1 :], cycles - 1)]
    time = record.time_s[1] * np.arange(run.size)
    longer = replace(record, time_s=time, torque_nm=record.torque_nm[run], angle_rad=record.angle_rad[run])
    return replace(unit, records=(longer,))


@pytest.mark.parametrize(("cycles", "names"), [(1, []), (2, ["leg 2", "leg 3", "leg 4", "leg 5"])])
def test_legs_within_reach_are_numbered_as_those_that_are_held_out(cycles, names):
    linear = joint_mode(reduce_unit(repeated(planted(0, loops=((0.1, 0.1),)), cycles)), library_terms())
    fitted, gap = fit_hypothesis(linear, (), levels(linear, ())), where.estimate_gap(linear, np.random.default_rng(0))
    held = shrink(fitted, fitted, gap.weight, np.random.default_rng(1))
    assert [held.names[k] for k in within_reach(linear)] == names and len(held.names) == 2 * cycles


@pytest.mark.parametrize(
    ("rates", "before", "hi", "whole", "unsupported"),
    [
        ((1.0, 1.0), 9.0, 0.3, 0.3, True),
        ((1.0, 1.0), 9.0, 0.6, 0.3, False),
        ((1.0, 1.0), 9.0, 0.3, 0.8, False),
        ((1.0, 1.0), 3.0, 0.3, 0.3, False),
        ((1.0, 9.0), 9.0, 0.3, 0.3, False),
    ],
    ids=[
        "a wide gap stays open",
        "it may be closed",
        "most of all that is held out is closed",
        "the gap is narrower than the noise",
        "no record is within reach",
    ],
)
def test_a_name_must_close_a_gap_that_is_seen_without_extrapolating(rates, before, hi, whole, unsupported):
    held = SimpleNamespace(clear_of_noise=lambda folds: before)
    found = SimpleNamespace(named=("torque_offset",), properties=(), withheld={}, linear=run_at(rates, (1.0, 1.0)), held_out=held)
    found.closed_of, found.closed = lambda folds: {"hi": hi}, {"hi": whole}
    assert examine.Found.unsupported.func(found) is unsupported


def test_the_closed_fraction_has_its_ends():
    assert closed_fraction(4.0, 1.0, 1.0) == 1.0 and closed_fraction(4.0, 4.0, 1.0) == 0.0
    assert closed_fraction(4.0, 2.25, 1.0) == pytest.approx(0.5)
    assert closed_fraction(4.0, 100.0, 1.0) == -1.0 and closed_fraction(1.0, 0.0, 1.0) == 1.0


def test_a_dwell_that_is_proposed_is_one_and_has_the_rate_of_its_ramps():
    """The torque rests at each tip, and thresholds follow the rate of the ramps on either side, not a multiple of it."""
    turning, rate = np.array([0.0, 1.0, -1.0, 1.0]), 0.5
    plain, dwells = (next_test._path(turning, rate, seconds) for seconds in (0.0, 30.0))
    rests = (dwells.t1 - dwells.t0) > 29.0
    assert rests.sum() == 2 and np.all(dwells.z0[rests] == dwells.z1[rests]) and np.all(np.abs(dwells.z0[rests]) == 1.0)
    assert plain.t1[-1] == pytest.approx(10.0) and dwells.t1[-1] == pytest.approx(70.0)
    usual = loading_rate(np.r_[dwells.t0[:1], dwells.t1], np.r_[dwells.z0[:1], dwells.z1])
    ramp = np.exp(np.log(usual) + np.broadcast_to(dwells.surge, (2, rests.size)))[:, np.abs(dwells.z1) < 0.5]
    assert ramp == pytest.approx(rate, rel=1e-6)


def test_loops_that_are_proposed_stay_within_the_angles_that_were_measured():
    """At turning points the torque stands still: a slope there must not divide by nothing."""
    linear = prepared("sensor_lag")[0]
    fitted = fit_hypothesis(linear, ("sensor_lag",), levels(linear, ("sensor_lag",)))
    for text, (history, rate) in next_test._tests(linear).items():
        angle = next_test._predict(fitted, history, rate)
        assert 0.2 < np.abs(angle).max() < 10.0, text


@pytest.mark.parametrize(
    ("unit", "effect", "best"), [("sensor_lag", "sensor_lag", "0.5 N·m/s"), ("none", "rate_dependent_friction", "0.004 N·m/s")]
)
def test_the_measurement_that_is_proposed_tells_more_than_another_of_those_that_were_made(unit, effect, best):
    """What follows the rate shows at another rate. The planted fault was to take weights for known, drifts of a record to come
    for those of the first, and the noise of samples for all that is in doubt: every loop told everything, a repeated one too."""
    linear = prepared(unit)[0]
    pair = tuple(fit_hypothesis(linear, h, levels(linear, h)) for h in ((), (effect,)))
    proposed = next_test.propose(pair, (0.6, 0.4))
    assert proposed["do"].endswith(best)
    assert proposed["others"][next_test.AGAIN] < 0.5 * proposed["expected_entropy_drop_bits"] < 0.4
    assert proposed["expected_entropy_drop_bits"] == max(proposed["others"].values())
    assert next_test.propose(pair[:1] * 2, (0.6, 0.4)) is None, "of what predicts the same nothing is told"


def test_the_separation_is_that_of_equal_scatter_and_the_lesser_of_unequal_one():
    rng = np.random.default_rng(0)
    one = np.r_[np.zeros((1, 6)), 0.3 * rng.standard_normal((3, 6))]
    away = rng.standard_normal(6)
    spread = one[1:].T @ one[1:] + 0.04 * np.eye(6)
    assert next_test._separation(one, one + away, 0.2) == pytest.approx(away @ np.linalg.solve(spread, away))
    wide = np.r_[one, 30.0 * np.eye(6)[:1]]
    assert 2.0 < next_test._separation(one, wide, 0.2) < 12.0
    assert next_test._separation(one, one, 0.2) == pytest.approx(0.0, abs=1e-9)
