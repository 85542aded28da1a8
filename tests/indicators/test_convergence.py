"""Indicators converge themselves, and a posterior that contradicts the measured cycle is not to be used."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import KNOWN_NOISE
from support.made_posterior import known, made_posterior

from backdrive_bayes.bench.known_truth import KnownReducer, simulate_unit
from backdrive_bayes.indicators.convergence import SHARE, _width_as_read, contradictions, convergence_json, examined
from backdrive_bayes.indicators.draws import CORE, IndicatorDraws
from backdrive_bayes.indicators.indicators import loop_area_j, peak_angle_rad, zero_torque_width_rad
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.measured_loop import measured_loops
from backdrive_bayes.records.noise import estimate_noise
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.reduction import reduce_record

LOOPS = ((0.05, 0.1), (0.05, 0.04))


@pytest.fixture(scope="module")
def unit():
    return simulate_unit(known(), [(a, r) for r, a in LOOPS], KNOWN_NOISE, np.random.default_rng(1))


def fitted_to(truth, record):
    """A posterior of the truth with the blocks of a record."""
    segments = find_segments(record.time_s, record.torque_nm)
    noise = estimate_noise(record.time_s, record.torque_nm, record.angle_rad, segments)
    blocks = reduce_record(record, segments, noise, 40)
    posterior = made_posterior(truth, LOOPS[:1], shape=(4, 50))
    facts = replace(posterior.records, blocks=(blocks,), amplitude_nm=np.array([blocks.amplitude_nm]))
    return replace(posterior, records=facts, predicted_rad=(blocks.angle_rad,))


def judged(truth, unit, **options):
    posterior = made_posterior(truth, LOOPS, shape=(4, 250), **options)
    return examined(IndicatorDraws(posterior, 0.03), unit)


def test_the_right_posterior_stands(unit):
    found = judged(known(), unit)
    assert found.converged and found.doubts == ()
    assert len(found.convergence.names) == len(made_posterior().weights) + len(CORE) * len(LOOPS)
    assert convergence_json(found)["contradictions"] == []


@pytest.mark.parametrize(("change", "said"), [({"drag": 0.08}, "loop area S"), ({"compliance": 0.8}, "peak angle")])
def test_a_wrong_posterior_is_told_with_both_numbers(unit, change, said):
    found = judged(known(**change), unit)
    assert not found.converged and any(said in text for text in found.doubts)
    told = convergence_json(found)
    assert not told["converged"] and told["advice"].startswith("contradicts the measurement: ")
    assert "was measured as" in told["advice"] and "inferred as" in told["advice"]


def test_width_at_zero_torque_counts_too(unit):
    truth = known()
    wide = KnownReducer(truth.weights | {"clearance": 1.2 * truth.weights["clearance"]})
    assert any("w(0)" in text for text in judged(wide, unit).doubts)


def test_a_loop_off_centre_is_compared_with_itself():
    """Between its own tips; the loop of its amplitude about zero, the fault that was there, has other numbers."""
    truth, (low, high), rate = known(), (-0.05, 0.1), 0.05
    corner = np.array([0.0, high, low, high])
    at = np.r_[0.0, np.cumsum(np.abs(np.diff(corner)))] / rate
    time = np.arange(0.0, at[-1], 1 / 200.0)
    torque, rng = np.interp(time, at, corner), np.random.default_rng(4)
    noisy = truth.angle_rad(time, torque) + 5e-5 * rng.standard_normal(time.size)
    record = Record("a.csv", time, torque + 1e-4 * rng.standard_normal(time.size), noisy, rate, None)
    draws = IndicatorDraws(fitted_to(truth, record), 0.03)
    measured = measured_loops(Unit("u", 0.1, (record,)))
    assert contradictions(draws, measured) == []
    blocks = draws.posterior.records.blocks[0]
    assert blocks.tips_nm == pytest.approx((low, high), rel=0.02)
    whole = peak_angle_rad(draws.loops(rate, blocks.amplitude_nm)).mean()
    assert abs(measured[0].half_peak_to_peak_rad / whole - 1.0) > SHARE["settled"]


@pytest.mark.parametrize(("change", "doubted"), [({}, False), ({"drag": 0.09}, True)], ids=["right", "wrong"])
def test_of_a_first_cycle_the_leg_between_the_tips_counts(change, doubted):
    """Unloaded from the tip that it goes to first, it encloses half as much as the settled loop: no contradiction, though with
    its whole area (planted fault) it is one. A leg that does enclose something else is one."""
    truth, rate, rng = known(), 0.05, np.random.default_rng(5)
    corner = np.array([0.1, 0.0, 0.1, -0.1, 0.0])
    at = np.r_[0.0, np.cumsum(np.abs(np.diff(corner)))] / rate
    time = np.arange(0.0, at[-1], 1 / 200.0)
    torque, after = np.interp(time, at, corner), time >= at[1]

    def read(reducer, noise_rad, noise_nm):
        angle = reducer.angle_rad(np.r_[-4.0, -2.0, time], np.r_[0.0, 0.1, torque])[2:][after]
        angle = angle + noise_rad * rng.standard_normal(angle.size)
        return Record("a.csv", time[after], torque[after] + noise_nm * rng.standard_normal(angle.size), angle, rate, None)

    record, wrong = read(known(), 5e-5, 1e-4), known(**change)
    posterior = fitted_to(wrong, record)
    blocks = posterior.records.blocks[0]
    exact = np.interp(blocks.mid_s, time[after], read(wrong, 0.0, 0.0).angle_rad)
    draws = IndicatorDraws(replace(posterior, predicted_rad=(exact,)), 0.03)
    (measured,) = measured_loops(Unit("u", 0.1, (record,)))
    settled = loop_area_j(IndicatorDraws(fitted_to(truth, record), 0.03).loops(rate, blocks.amplitude_nm)).mean()
    assert measured.basis == "first" and measured.loop_area_j < (1.0 - SHARE["first"]) * settled
    assert any("loop area S" in text for text in contradictions(draws, (measured,))) == doubted


def test_a_step_next_to_zero_torque_is_compared_as_it_was_read():
    """Samples tell the mean width next to zero; at zero itself it is twice as large here (planted fault: compared with that)."""
    truth = known(drag=0.003)
    unit = simulate_unit(truth, [(a, r) for r, a in LOOPS], KNOWN_NOISE, np.random.default_rng(3))
    assert judged(truth, unit).doubts == ()
    draws = IndicatorDraws(made_posterior(truth, LOOPS, shape=(4, 50)), 0.03)
    read, loops = measured_loops(unit)[0], draws.loops(*LOOPS[0])
    assert read.zero_torque_width_rad == pytest.approx(_width_as_read(loops, read.zero_nm).mean(), rel=0.05)
    assert zero_torque_width_rad(loops).mean() > 1.8 * read.zero_torque_width_rad


def test_what_a_late_channel_adds_is_no_contradiction():
    truth, lag_s = known(), 0.04
    unit = simulate_unit(truth, [(a, r) for r, a in LOOPS], KNOWN_NOISE, np.random.default_rng(2))
    late = tuple(replace(r, angle_rad=np.interp(r.time_s - lag_s, r.time_s, r.angle_rad)) for r in unit.records)
    unit = replace(unit, records=late)
    assert judged(truth, unit, lag_s=0.0).doubts and not judged(truth, unit, lag_s=lag_s).doubts


def test_ensembles_that_disagree_about_an_indicator_have_not_converged():
    posterior = made_posterior(loops=LOOPS, shape=(4, 250))
    posterior.weights["elastic"][1] *= 1.05
    found = examined(IndicatorDraws(posterior, 0.03))
    assert not found.converged and np.nanmax(found.convergence.rhat) > 1.05
