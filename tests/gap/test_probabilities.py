"""From log Bayes factors to probabilities: what more evidence, more misfit and a second name do."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backdrive_bayes.gap.probabilities import CALIBRATION, credible_set, labels, log_misfit, log_prior, probabilities, unlisted
from backdrive_bayes.gap.table import KINDS

FACTORS = st.floats(-30.0, 1e4)


def given_factors(lag=0.0, drift=0.0, both=0.0, unknown=0.0):
    log = {(): 0.0, ("lag",): lag, ("drift",): drift, ("drift", "lag"): both, ("unknown",): unknown}
    return log | {("lag", "unknown"): max(lag, unknown), ("drift", "unknown"): max(drift, unknown)}


def answer(log, left=None, properties=None, leaps=None, disturbance=-np.inf, calibration=CALIBRATION):
    left = {h: 1.0 for h in log if "unknown" not in h} | (left or {})
    return probabilities(log, leaps or {}, disturbance, left, properties or {}, calibration)


@given(FACTORS, FACTORS, FACTORS, FACTORS, st.floats(0.03, 0.97))
def test_probabilities_are_probabilities(lag, drift, both, unknown, p):
    joint = answer(given_factors(lag, drift, both, unknown), properties={"slip": p})
    values = np.array(list(joint.values()))
    assert np.isfinite(values).all() and np.all(values >= 0) and values.sum() == pytest.approx(1.0)
    assert sum(labels(joint).values()) == pytest.approx(1.0)
    assert 0 <= unlisted(joint) <= 1


def test_nothing_is_likeliest_where_nothing_speaks():
    found = labels(answer(given_factors()))
    assert next(iter(found)) == "none" and found["none"] > 0.6


def test_more_evidence_makes_a_name_more_probable():
    shares = [labels(answer(given_factors(lag=x, both=x)))["lag"] for x in (0.0, 5.0, 20.0, 200.0)]
    assert shares == sorted(shares) and shares[-1] > 0.7


def test_a_second_name_must_earn_its_place():
    alone = labels(answer(given_factors(lag=50.0, both=51.0)))
    assert alone["lag"] > 10 * alone["drift+lag"]
    together = labels(answer(given_factors(lag=50.0, drift=40.0, both=250.0)))
    assert next(iter(together)) == "drift+lag"
    prior = {h: log_prior(h, CALIBRATION) for h in ((), ("lag",), ("drift", "lag"), ("encoder_error",))}
    assert prior[("drift", "lag")] < prior[("lag",)] < prior[()] == 0.0 and prior[("encoder_error",)] < prior[("lag",)]


def test_what_is_left_speaks_for_something_unlisted():
    log = given_factors(unknown=20.0)
    listed = [h for h in log if "unknown" not in h]
    assert unlisted(answer(log, dict.fromkeys(listed, 50.0))) > unlisted(answer(log, dict.fromkeys(listed, 1.0)))
    one = dict.fromkeys(listed, 50.0) | {("lag",): 1.0}
    assert answer(log, one)[("unknown",)] < answer(log, dict.fromkeys(listed, 50.0))[("unknown",)], "a lag explains it"


def test_a_property_stands_beside_the_rest():
    found = labels(answer(given_factors(), properties={"slip": 0.97}))
    assert next(iter(found)) == "slip"


@pytest.mark.parametrize("bayes_factor", [1.0, 30.0])
def test_a_property_beside_another_effect_has_the_prior_of_a_second_one(bayes_factor):
    odds = bayes_factor * np.exp(log_prior(("slip",), CALIBRATION))
    joint = answer(given_factors(lag=1e4, both=1e4), properties={"slip": odds / (1.0 + odds)})
    second = np.exp(log_prior(("lag", "slip"), CALIBRATION) - log_prior(("lag",), CALIBRATION))
    assert joint[("lag", "slip")] / joint[("lag",)] == pytest.approx(bayes_factor * second)


def test_what_kind_something_unlisted_is_keeps_its_odds_however_hot():
    """Two names whose best model explains as much: that of one kind among many keeps the odds of one among many."""
    listed, kinds = 400.0, 400.0 - np.log(KINDS)
    log = given_factors(lag=listed, unknown=kinds) | {("lag", "unknown"): listed}
    for warm in (0.0, 2.0, 20.0):
        calibration = replace(CALIBRATION, warm=warm, unlisted=0.0, single=0.0)
        joint = answer(log, calibration=calibration)
        due = np.exp(log_misfit(1.0, CALIBRATION.spread))
        one = due / (KINDS + 1)
        # The hotter, the more the other kinds count, and no effect at all.
        assert 0.999 * one < joint[("unknown",)] / joint[("lag",)] < one * (1.1 if warm <= 2.0 else 8.0)


@pytest.mark.parametrize("lag", [0.0, 2000.0])
def test_a_disturbance_speaks_for_something_unlisted_however_hot_the_contrasts(lag):
    """A planted fault: one that counts among the contrasts is coarsened with them."""
    log = given_factors(lag=lag)
    assert unlisted(answer(log, disturbance=20.0)) > 0.99 > 0.5 > unlisted(answer(log, disturbance=0.0))
    among = log | {h: v + 20.0 for h, v in log.items() if "unknown" in h}
    assert unlisted(answer(among)) < 0.95


def test_a_disturbance_is_one_kind_among_many():
    """Its odds to a kind in the contrasts that explains as much are even."""
    log = given_factors(unknown=400.0 - np.log(KINDS))
    cold = replace(CALIBRATION, cool=1.0, warm=0.0)
    one, both = (answer(log, disturbance=d, calibration=cold) for d in (-np.inf, 400.0))
    assert both[("unknown",)] / both[()] == pytest.approx(2.0 * one[("unknown",)] / one[()], rel=1e-3)


def test_what_teeth_leave_does_not_speak_for_something_unlisted():
    log = given_factors() | {("stick_slip",): 40.0}
    listed = [h for h in log if "unknown" not in h]
    quiet, rough = dict.fromkeys(listed, 1.0), dict.fromkeys(listed, 20.0)
    assert unlisted(answer(log, rough, leaps={("stick_slip",): 40.0})) < 0.1
    assert unlisted(answer(given_factors(lag=40.0), rough)) > 0.5, "another effect that leaves as much is not all"
    unseen = log | {("stick_slip",): -0.5, ("lag",): 40.0}
    unseen_leaps = {("stick_slip",): -0.5}
    assert unlisted(answer(unseen, rough, leaps=unseen_leaps)) > 0.5, "teeth that were not found leave nothing"
    assert unlisted(answer(unseen, quiet, leaps=unseen_leaps)) < 0.5


@pytest.mark.parametrize("leaps", [200.0, 2000.0])
def test_leaps_however_clear_do_not_drown_what_the_contrasts_say(leaps):
    """A planted fault: leaps that count among the contrasts heat them."""
    contrasts = {(): 0.0, ("lag",): 14.0, ("stick_slip",): 0.0, ("lag", "stick_slip"): 14.0}
    teeth = {h: leaps for h in contrasts if "stick_slip" in h}
    log = {h: value + teeth.get(h, 0.0) for h, value in contrasts.items()}

    def odds(found):
        return found[("lag", "stick_slip")] / found[("stick_slip",)]

    alone = answer({h: v for h, v in contrasts.items() if h not in teeth})
    second = np.exp(CALIBRATION.second - CALIBRATION.single)
    assert odds(answer(log, leaps=teeth)) == pytest.approx(second * alone[("lag",)] / alone[()], rel=0.2)
    assert odds(answer(log)) < 0.5 * odds(answer(log, leaps=teeth))


def test_a_credible_set_holds_the_fewest_answers():
    assert credible_set({"a": 0.5, "b": 0.1, "c": 0.4}, 0.9) == ["a", "c"]
    assert credible_set({"a": 0.95, "b": 0.05}) == ["a"] and CALIBRATION.cover > 0.9


def test_a_factor_that_is_no_number_is_an_error():
    with pytest.raises(FloatingPointError):
        answer(given_factors(lag=float("nan")))
