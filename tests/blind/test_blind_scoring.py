"""Scores by hand on small cases, and planted faults that they must show."""

import numpy as np
import pytest
from invented import LABELS, cell, diagnosis, entry, honest, make_key, many_labels, replies, says

from backdrive_bayes.blind.answers import Answer, canonical, understand
from backdrive_bayes.blind.calibration import calibration, curve, log_score
from backdrive_bayes.blind.intervals import clopper_pearson, macro_share, share
from backdrive_bayes.blind.scoring import score
from backdrive_bayes.blind.where import overlap
from backdrive_bayes.errors import BadInput


def test_binomial_intervals_are_the_published_ones():
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert clopper_pearson(5, 10) == pytest.approx((0.1871, 0.8129), abs=1e-4)
    assert clopper_pearson(10, 10) == pytest.approx((0.6915, 1.0), abs=1e-4)
    assert share([])["share"] is None and share([True, False]) | {"lo": 0, "hi": 0} == {
        "share": 0.5,
        "count": 1,
        "of": 2,
        "lo": 0,
        "hi": 0,
    }


def test_macro_weighs_classes_alike():
    found = macro_share([[True] * 9 + [False], [False, True], []])
    assert found["share"] == pytest.approx(0.5 * (0.9 + 0.5)) and found["of"] == 12 and found["groups"] == 2
    assert found["effective"] == pytest.approx(4 / (1 / 10 + 1 / 2))
    assert macro_share([[True] * 5, [True] * 5])["effective"] == pytest.approx(10)


def test_scores_of_a_small_check_by_hand():
    key = make_key(["none", "none", "sensor_lag", "sensor_lag", "thermal_drift", "unknown", "sensor_lag+stick_slip"])
    answers = {
        "unit-0001": says("none"),
        "unit-0002": says("thermal_drift", 0.6, credible=["thermal_drift", "none"]),
        "unit-0003": says("sensor_lag", 0.8),
        "unit-0004": says("unknown", 0.5),
        "unit-0005": Answer(None, "ValueError: no"),
        "unit-0006": says("unknown"),
        "unit-0007": says("sensor_lag"),
    }
    found = score(key, answers)
    assert found["counts"] == {"units": 7, "answered": 6, "failed": 1}
    assert found["failures"] == [{"unit": "unit-0005", "error": "ValueError: no"}]
    assert found["top_1"]["all"]["count"] == 3
    assert found["top_1"]["macro"]["share"] == pytest.approx(np.mean([0.5, 0.5, 0.0, 1.0, 0.0]))
    assert found["top_1"]["by_severity"][0]["listed"]["share"] == pytest.approx(0.25)
    assert found["false_alarms"]["named"]["count"] == found["false_alarms"]["effect_named"]["count"] == 1
    assert found["false_alarms"]["gap"]["share"] == 0.5
    assert found["abstention"]["unknown"]["share"] == 1.0 and found["abstention"]["by_effect"]["mains_hum"]["of"] == 1
    assert found["credible_sets"]["coverage"] | {"lo": 0, "hi": 0} == {"share": 4 / 7, "count": 4, "of": 7, "lo": 0, "hi": 0}
    assert found["credible_sets"]["size"]["mean"] == pytest.approx(7 / 6) and found["credible_sets"]["sizes"] == {"1": 5, "2": 1}
    assert found["pairs"]["both"]["count"] == 0 and found["pairs"]["one_or_both"]["count"] == 1
    assert found["power"][0]["named"]["count"] == 1 and found["power"][0]["misnamed"]["count"] == 0
    table = found["confusion"]
    at = {(t, a): table["counts"][i][j] for i, t in enumerate(table["truth"]) for j, a in enumerate(table["answer"])}
    assert sum(at.values()) == 7
    assert at["pair", "sensor_lag"] == at["thermal_drift", "no answer"] == at["sensor_lag", "unknown"] == at["none", "none"] == 1


def test_pairs_are_right_in_any_order_and_otherwise_another_pair():
    key = make_key(["sensor_lag+stick_slip"] * 2)
    answers = {
        "unit-0001": understand(
            diagnosis("stick_slip") | {"answer": {"effects": ["stick_slip", "sensor_lag"], "credible_set_90": []}}
        ),
        "unit-0002": says("sensor_lag+thermal_drift"),
    }
    found = score(key, answers)
    row = dict(zip(found["confusion"]["answer"], found["confusion"]["counts"][-1], strict=True))
    assert row["pair"] == row["other pair"] == 1 and found["pairs"]["both"]["count"] == 1
    assert canonical("b+a") == canonical(["a", "b"]) == canonical("a + b") == "a+b" and canonical([]) == "none"


def test_overlap_by_hand():
    truth = entry(1, "sensor_lag")["where"]["remainder"]
    perfect = [cell(0.5), cell(0.5, branch="unload+")]
    assert overlap(truth, perfect) == pytest.approx(1.0)
    assert overlap(truth, [cell(1.0)]) == pytest.approx(0.5)
    assert overlap(truth, [cell(1.0, 0.0, 2.0)]) == pytest.approx(0.5), "half of it lies below, 0.5 of 0.5 above"
    assert overlap(truth, [cell(1.0, -2.0, -1.0, "load-")]) == 0.0
    assert overlap(truth, [cell(1.0, record="b")]) == 0.0
    assert overlap(truth, perfect * 3) == pytest.approx(1.0), "cycles add up"
    assert overlap(truth, [cell(1.0, 1.9, 2.6), cell(1.0, 1.5, 1.5, "unload+")]) == pytest.approx(1.0), "beyond the last edge"
    assert overlap(truth, []) is None and overlap(None, perfect) is None


def test_negative_branches_may_be_given_either_way_up():
    shares = {"load+": [0.0, 0.0], "unload+": [0.0, 0.0], "load-": [0.25, 0.75], "unload-": [0.0, 0.0]}
    truth = [{"record": "a", "edges_Nm": [0.0, 1.0, 2.0], "share": shares}]
    for sign in (1, -1):
        cells = [cell(0.25, sign * 0.0, sign * 1.0, "load-"), cell(0.75, sign * 2.0, sign * 1.0, "load-")]
        assert overlap(truth, cells) == pytest.approx(1.0)


def test_a_missing_map_counts_as_no_overlap_beside_the_mean_of_the_others():
    key = make_key(["sensor_lag"] * 2)
    full = [cell(0.5), cell(0.5, branch="unload+")]
    found = score(key, {"unit-0001": says("sensor_lag", cells=full), "unit-0002": says("none")})["where"]["remainder"]
    assert found["mean"] == pytest.approx(1.0) and found["of"] == 1
    assert found["with_zeros"]["mean"] == pytest.approx(0.5) and found["with_zeros"]["of"] == 2


def test_closed_fraction_beside_the_oracle_and_removed_effects():
    key = make_key(["sensor_lag", "sensor_lag", "none", "stick_slip"])
    answers = {
        "unit-0001": says("sensor_lag", closed=0.9),
        "unit-0002": says("sensor_lag", closed=0.5),
        "unit-0003": says("none"),
        "unit-0004": says("stick_slip", closed=0.7),
    }
    oracle = {"unit-0001": says("sensor_lag", closed=0.95), "unit-0002": says("sensor_lag", closed=0.8)}
    removed = {"unit-0001": says("unknown"), "unit-0002": says("stick_slip"), "unit-0004": Answer(None, "no")}
    found = score(key, answers, oracle, removed)
    assert found["closed"]["closed_fraction"]["median"] == 0.7
    assert found["closed"]["difference"]["median"] == pytest.approx(0.175) and found["closed"]["near_oracle"]["count"] == 1
    assert found["removed"]["unknown"]["count"] == found["removed"]["misnamed"]["count"] == 1
    assert found["removed"]["unknown"]["of"] == 3 and found["removed_failures"][0]["unit"] == "unit-0004"


def test_log_score_is_in_nats_and_floored():
    found = log_score([{"a": 0.5, "b": 0.5}, {"a": 1.0}], ["a", "b"])
    assert found["mean"] == pytest.approx(0.5 * (np.log(2) + np.log(1e6))) and found["floored"] == 1


def test_calibration_curve_by_hand():
    found = curve([0.95, 0.95, 0.25, 0.25], [1, 0, 0, 0])
    assert found["expected_error"] == pytest.approx(0.5 * 0.45 + 0.5 * 0.25)
    assert [b["of"] for b in found["bins"]] == [2, 2] and found["bins"][1]["count"] == 1
    assert curve([], [])["expected_error"] is None


def verdicts(found):
    return {mark["mark"]: mark["met"] for mark in found["marks"]}


def test_an_honest_diagnoser_is_calibrated_and_an_over_confident_one_is_not():
    """A calibrated one is beyond the 95 % quantile in about one of twenty: at most 5 of 30 (P < 0.4 %)."""
    rng, beyond = np.random.default_rng(1), 0
    for _ in range(30):
        truths = many_labels(rng, 200)
        forecasts = [honest(rng, truth, rng.uniform(0.3, 1.0)).probabilities for truth in truths]
        beyond += calibration(forecasts, truths)["top"]["too_far"]
    assert beyond <= 5
    key = make_key(many_labels(rng, 200))
    sure = replies(key, lambda e: says(honest(rng, e["label"], 0.7).label, 0.99))
    found = score(key, sure)
    assert found["calibration"]["top"]["too_far"] and found["calibration"]["all_classes"]["too_far"]
    assert not verdicts(found)["calibration error of the top probability"]
    assert not verdicts(found)["coverage of the 90 % sets"]


def test_a_perfect_diagnoser_meets_the_marks_and_a_shuffled_key_fails_them():
    rng = np.random.default_rng(2)
    key = make_key(many_labels(rng, 240))
    full = [cell(0.5), cell(0.5, branch="unload+")]
    answers = replies(key, lambda e: says(e["label"], 0.99, cells=full))
    found = score(key, answers, oracle=answers, removed={})
    assert all(met for met in verdicts(found).values() if met is not None)
    labels = [e["label"] for e in key["units"]]
    shuffled = make_key([labels[i] for i in rng.permutation(len(labels))])
    found = score(shuffled, answers)
    assert found["top_1"]["macro"]["share"] < 0.25
    failed = {mark for mark, met in verdicts(found).items() if met is False}
    assert {"macro top-1 of listed effects, severity 1", "false alarms: anything named on none"} <= failed
    assert found["calibration"]["log_score"]["mean"] > np.log(len(LABELS))


def test_a_diagnoser_that_always_alarms_or_never_abstains_is_shown():
    key = make_key(["none"] * 40 + ["unknown"] * 40)
    found = verdicts(score(key, replies(key, lambda e: says("sensor_lag"))))
    assert found["false alarms: anything named on none"] is False and found["unlisted effects called unknown"] is False


def test_effects_short_of_their_severity_are_shown_apart():
    key = {"units": [entry(1, "sensor_lag"), entry(2, "sensor_lag", limited=True)]}
    found = score(key, {"unit-0001": says("sensor_lag"), "unit-0002": says("none")})
    row = found["top_1"]["by_severity"][0]
    assert row["listed"]["share"] == 0.5 and row["listed_reached"]["share"] == 1.0
    assert [m["found"] for m in found["marks"] if "severity 1" in m["mark"]] == [1.0]


def test_no_answer_is_in_nobodys_favour():
    """The planted fault counts what failed as no alarm, and takes the overlap of the maps that there are."""
    key = make_key(["none"] * 10 + ["sensor_lag"] * 10)
    answers = {f"unit-{i:04d}": Answer(None, "no") for i in range(1, 21)}
    found = score(key, answers)
    assert verdicts(found)["false alarms: anything named on none"] is None
    one = answers | {"unit-0001": says("sensor_lag"), "unit-0011": says("sensor_lag", cells=[cell(1.0)])}
    found = score(key, one)
    assert found["false_alarms"]["named"]["share"] == 1.0 and found["false_alarms"]["named"]["of"] == 1
    assert verdicts(found)["mean overlap of where"] is False


@pytest.mark.parametrize(
    "spoilt",
    [
        {},
        {"which": [{"effect": "none", "probability": 0.4}]},
        {"which": [{"effect": "none", "probability": 1.7}, {"effect": "unknown", "probability": -0.7}]},
        {"answer": {}},
        {"gap": None},
        {"inconclusive": "the chains disagree"},
    ],
)
def test_what_is_no_diagnosis_counts_as_none_with_the_reason(spoilt):
    assert understand(diagnosis()).label == "none"
    answer = understand(diagnosis() | spoilt if spoilt else {})
    assert answer.label is None and answer.error


def test_an_answer_to_no_unit_of_the_key_is_refused():
    with pytest.raises(BadInput, match="unit-0009"):
        score(make_key(["none"]), {"unit-0009": says("none")})


def test_nothing_to_score_is_no_error():
    found = score(make_key(["none"]), {"unit-0001": Answer(None, "no")})
    assert found["counts"]["failed"] == 1 and found["calibration"]["top"]["expected_error"] is None
