"""Verdicts: what is accepted, rejected and left open, why, and what to measure next."""

import math

import numpy as np
import pytest
from support.decided import LOOPS, TYPICAL, diagnosis, evidence

from backdrive_bayes.decisions.acceptance import assess, largest_enclosed_j, limited_loops
from backdrive_bayes.decisions.global_risk import Process
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.decisions.loops import measured_loops
from backdrive_bayes.decisions.next_step import repeats_to_settle
from backdrive_bayes.errors import BadInput

AREA, SD = TYPICAL["loop_area_J"], 0.01 * TYPICAL["loop_area_J"]


def area(sds, **more):
    """An upper limit on S at 0.05 N·m/s, that many posterior standard deviations above the median."""
    return Limit("loop_area_J", hi=AREA + sds * SD, rate=0.05, where="limits.toml, loop_area_J", **more)


def judge(*limits, e=None, **options):
    return assess([e or evidence()], Limits(tuple(limits)), **options)


@pytest.mark.parametrize(
    ("sds", "verdict"), [(3, "accepted"), (1.8, "accepted"), (1.4, "inconclusive"), (-1.0, "inconclusive"), (-1.5, "rejected")]
)
def test_the_verdict_follows_the_distance_in_standard_deviations(sds, verdict):
    """z(0.95) = 1.64 above the limit accepts, z(0.90) = 1.28 below it rejects."""
    result = judge(area(sds))
    assert result["verdict"] == verdict
    row = result["limits"][0]
    assert row["specific_consumer_risk"] == pytest.approx(1 - row["conformance_probability"])
    assert (row["median"] <= row["accept_median_between"][1]) == (verdict == "accepted")
    assert (result["next"] is None) == (verdict != "inconclusive")


def test_halved_intervals_would_accept_what_is_open():
    """The planted fault that the verdict must react to."""
    assert judge(area(1.4))["verdict"] == "inconclusive"
    assert judge(area(1.4), e=evidence(spread=0.005))["verdict"] == "accepted"


def test_several_limits_are_kept_together_or_not():
    """Three independent limits with 4 % each: one alone would be accepted, all together are not."""
    limits = [Limit("peak_angle_rad", hi=TYPICAL["peak_angle_rad"] * (1 + 0.01 * 1.75), where="w")]
    result = judge(*limits)
    assert [r["verdict"] for r in result["limits"]] == ["accepted"] * 3
    assert result["verdict"] == "inconclusive"
    alone = [r["conformance_probability"] for r in result["limits"]]
    assert result["conformance_probability"] == pytest.approx(math.prod(alone), abs=0.02)
    assert result["next"]["repeats_in_all"] == 2 and "Repeat the records 1 time more" in result["next"]["do"]


@pytest.mark.parametrize("sds", [60, -60])
def test_a_risk_below_what_draws_tell_is_no_matter_of_repeats(sds):
    """A verdict would rest on no draw at all: neither accepted nor rejected, and repeating the records would not help."""
    result = assess([evidence()], Limits((area(sds),), 1e-5, 1e-5))
    assert result["verdict"] == "inconclusive" and result["next"]["repeats_in_all"] is None
    assert "Agree on larger risks" in result["next"]["do"] and "draws tell none below" in result["next"]["do"]
    assert "Agree" not in assess([evidence()], Limits((area(1.0),), 1e-5, 1e-5))["next"]["do"]


def test_the_limiting_indicator_is_the_least_sure_one():
    result = judge(area(1.4), Limit("peak_angle_rad", hi=1.0, where="w"))
    assert result["limiting"]["indicator"] == "loop_area_J"
    far = judge(area(4), Limit("peak_angle_rad", hi=1.0, where="w"))
    assert far["limiting"]["indicator"] == "loop_area_J", "of two certain ones the nearer in standard deviations"


def test_not_converged_is_inconclusive_whatever_the_numbers():
    for sds in (30, -30):
        result = judge(area(sds), e=evidence(converged=False))
        assert result["verdict"] == "inconclusive" and "not to be used: not converged" in result["reason"]
        assert "Check the records" in result["next"]["do"] and result["limits"][0]["verdict"] == "inconclusive"


def test_an_unexplained_gap_is_inconclusive():
    gap = diagnosis(["unknown"], unknown=0.3, none=0.1, viscoelastic_creep=0.6)
    result = judge(area(30), e=evidence(diagnosis=gap))
    assert result["verdict"] == "inconclusive" and "unknown" in result["reason"]
    assert "Measure at another rate" in result["next"]["do"]
    assert judge(area(-30), e=evidence(diagnosis=gap))["verdict"] == "inconclusive", "it may not be rejected either"


def test_an_effect_that_the_fit_holds_is_no_gap():
    found = diagnosis(["viscoelastic_creep"], viscoelastic_creep=0.97, none=0.03)
    assert judge(area(30), e=evidence(diagnosis=found))["verdict"] == "inconclusive"
    result = judge(area(30), e=evidence(diagnosis=found, effects=["viscoelastic_creep"]))
    assert result["verdict"] == "accepted" and result["structure"]["unknown_probability"] == 0


def test_what_a_diagnosis_does_not_answer_with_is_averaged_over_by_the_fit():
    found = diagnosis([], none=0.85, sensor_lag=0.05, unknown=0.1)
    result = judge(area(30), e=evidence(diagnosis=found))
    assert result["verdict"] == "accepted" and result["structure"]["uncovered"] == {}


def test_a_property_of_the_operator_is_held_by_every_fit():
    found = diagnosis(["interface_slip"], interface_slip=0.9, none=0.1)
    assert judge(area(30), e=evidence(diagnosis=found))["verdict"] == "accepted"
    lag = diagnosis(["interface_slip", "sensor_lag"], **{"interface_slip+sensor_lag": 0.9, "none": 0.1})
    assert judge(area(30), e=evidence(diagnosis=lag))["verdict"] == "inconclusive"


def test_a_pair_of_which_the_fit_holds_both_is_no_gap():
    found = diagnosis(["sensor_lag", "viscoelastic_creep"], **{"sensor_lag+viscoelastic_creep": 0.97, "none": 0.03})
    assert judge(area(30), e=evidence(diagnosis=found, effects=["viscoelastic_creep"]))["verdict"] == "inconclusive"
    both = evidence(diagnosis=found, effects=["sensor_lag", "viscoelastic_creep"])
    assert judge(area(30), e=both)["verdict"] == "accepted"


def test_what_acts_unlisted_beside_a_named_module_is_uncovered():
    """The planted fault: its probability is in the module's name and not in "unknown"."""
    found = diagnosis(["geometric"], geometric=0.96, unknown=0.04)
    assert judge(area(30), e=evidence(diagnosis=found, effects=["geometric"]))["verdict"] == "accepted"
    found["gap"] = {"unlisted_probability": 0.9}
    result = judge(area(30), e=evidence(diagnosis=found, effects=["geometric"]))
    assert result["verdict"] == "inconclusive" and result["structure"]["uncovered"] == {"unknown": 0.9}
    with pytest.raises(BadInput, match="between 0 and 1"):
        judge(area(30), e=evidence(diagnosis=found | {"gap": {"unlisted_probability": float("nan")}}))


def test_no_verdict_on_the_gap_no_verdict_on_the_unit():
    found = diagnosis([], none=0.97, sensor_lag=0.03) | {"inconclusive": "the search has not settled", "gap": {"rms_rad": 1e-9}}
    for sds in (30, -30):
        assert judge(area(sds), e=evidence(diagnosis=found))["verdict"] == "inconclusive"


def test_models_that_stay_probable_are_averaged():
    one, other = evidence(), evidence(effects=["sensor_lag"], loop_area_J=AREA + 8 * SD)
    limits = Limits((area(4),))
    mixed = assess([one, other], limits, [0.7, 0.3])
    assert mixed["verdict"] == "inconclusive"
    assert mixed["conformance_probability"] == pytest.approx(0.7, abs=0.01)
    assert assess([one, other], limits, [0.97, 0.03])["verdict"] == "accepted"
    assert assess([one, other], limits, [0.02, 0.98])["verdict"] == "rejected"
    row = mixed["limits"][0]
    assert row["hi"] > AREA + 7 * SD and row["lo"] < AREA, "the interval is that of the mixture"
    assert len(mixed["structure"]["models"]) == 2


@pytest.mark.parametrize("wrong", [[0.7, 0.4], [1.2, -0.2], [0.5], [0.0, 0.0]])
def test_wrong_probabilities_are_refused(wrong):
    with pytest.raises(BadInput, match="one probability a model"):
        assess([evidence(), evidence()], Limits((area(1),)), wrong)
    with pytest.raises(BadInput, match="a probability for each"):
        assess([evidence(), evidence()], Limits((area(1),)))
    with pytest.raises(BadInput, match="of one unit"):
        assess([evidence("a"), evidence("b")], Limits((area(1),)), [0.5, 0.5])


def test_a_broken_diagnosis_is_one_clear_line():
    with pytest.raises(BadInput, match="diagnosis.json"):
        judge(area(1), e=evidence(diagnosis={"which": "?"}))


def test_limits_without_a_rate_hold_for_the_largest_loops():
    loops = measured_loops(*zip(*LOOPS, (0.05, 0.04), strict=True))
    everywhere = limited_loops(Limit("peak_angle_rad", hi=1.0), loops)
    assert [x.rate for x in everywhere] == [0.01, 0.05, 0.1] and all(x.amplitude == 0.1 for x in everywhere)
    small = limited_loops(Limit("peak_angle_rad", hi=1.0, amplitude=0.04), loops)
    assert [x.predicted for x in small] == [True, False, True]


def test_a_limit_that_cannot_be_told_is_one_clear_line():
    for limit, reason in (
        (Limit("loop_area_J", hi=1.0, rate=0.5, where="limits.toml, loop_area_J"), "was not measured"),
        (Limit("loop_area_J", hi=1.0, amplitude=0.5, where="limits.toml, loop_area_J"), "beyond the measured"),
        (Limit("tau1_Nm", hi=1.0, amplitude=0.001, where="limits.toml, tau1_Nm"), "smallest that is predicted"),
        (Limit("lost_motion_rad", hi=1.0, k=0.04, where="limits.toml, lost_motion_rad"), "k = 0.04"),
    ):
        with pytest.raises(BadInput, match=reason) as error:
            judge(limit)
        assert "limits.toml" in str(error.value)


def test_a_predicted_loop_is_to_be_measured():
    predicted = Limit("absorbed_J", hi=0.36 * TYPICAL["absorbed_J"], rate=0.05, amplitude=0.06, where="w")
    result = judge(predicted)
    assert result["verdict"] == "inconclusive" and result["limits"][0]["predicted"]
    assert "Measure a loop at 0.05 N·m/s and ±0.06 N·m itself" in result["next"]["do"]


def test_repeats_that_would_settle():
    """One standard deviation away: accepted at z(0.95)² = 2.7, so with three records."""


    def needed(limit, rows=1):
        row = {"median": 0.0, "sd": 1.0, "min": -math.inf, "max": limit}
        return repeats_to_settle([row] * rows, 0.05, 0.1)

    assert needed(1.0) == 3 and needed(1.0, rows=3) > 3
    assert needed(5.0) == 2, "one more at least"
    assert needed(-0.1) is None, "on the limit nothing settles"
    text = judge(area(1.0))["next"]
    assert text["repeats_in_all"] == 3 and "2 times more" in text["do"]
    stuck = judge(area(0.5))
    assert stuck["next"]["repeats_in_all"] is None or stuck["next"]["repeats_in_all"] > 8


def test_global_risks_come_with_process_knowledge_or_a_batch():
    assert judge(area(3))["limits"][0]["global"] is None
    stated = judge(area(3, process=Process(AREA, 3 * SD)))["limits"][0]["global"]
    assert stated["nonconforming"] == pytest.approx(0.159, abs=0.01) and stated["consumer"] < 0.01 < stated["inconclusive"]
    rng = np.random.default_rng(0)
    batch = [evidence(f"b{i}", seed=i, loop_area_J=AREA + 3 * SD * rng.standard_normal()) for i in range(12)]
    told = judge(area(3), batch=batch)["limits"][0]["global"]
    assert told["batch_units"] == 12 and 1.5 * SD < told["process"]["sd"] < 6 * SD
    with pytest.raises(BadInput, match="at least 3 other units"):
        judge(area(3), batch=batch[:2])
    with pytest.raises(BadInput, match="the data of b1 once more"):
        judge(area(3), batch=[*batch, batch[1]])
    lost = Limit("lost_motion_rad", hi=1.0, rate=0.05, where="w")
    with pytest.raises(BadInput, match="give the same k·T_r"):
        judge(lost, batch=[evidence(f"k{i}", seed=i, k=0.1) for i in range(3)])


def test_the_naive_decision_stands_beside():
    row = judge(area(3))["limits"][0]
    assert row["naive"] == {"value": 3.0e-4, "inside": True}
    assert judge(Limit("peak_angle_rad", hi=1.0, where="w"))["limits"][0]["naive"]["value"] is None


def test_an_unknown_cause_moves_an_area_no_further_than_the_gap_that_it_leaves():
    """Out of limits by more than the gap can enclose is rejected, whatever the cause; by less, or of a peak, it is open."""
    found, unit = diagnosis(["unknown"], unknown=0.9, none=0.1), evidence()
    worth = 10 * SD / largest_enclosed_j(1.0, unit.largest()[0].amplitude, unit.draws.travelled_nm)
    small, large = (evidence(diagnosis=found | {"gap": {"rms_rad": worth * f}}) for f in (1.0, 4.0))
    assert judge(area(-30), e=small)["verdict"] == "rejected" and judge(area(-30), e=large)["verdict"] == "inconclusive"
    assert judge(area(30), e=small)["verdict"] == "inconclusive", "a gap of unknown cause accepts nothing"
    peak = Limit("peak_angle_rad", hi=0.5 * TYPICAL["peak_angle_rad"], rate=0.05, where="w")
    assert judge(peak, e=small)["verdict"] == "inconclusive"
    absorbed = Limit("absorbed_J", hi=0.5 * TYPICAL["absorbed_J"], rate=0.05, where="w")
    assert judge(absorbed, e=small)["verdict"] == "inconclusive", "it holds the tip's angle, which no mean bounds"
    assert judge(peak, area(-30), e=small)["verdict"] == "rejected", "one limit that is surely broken is enough"


@pytest.mark.parametrize("onset", [-1.0, 0.6, 0.9])
@pytest.mark.parametrize("amplitudes", [(1.0,), (1.0, 0.2), (1.0, 0.4, 0.4)])
def test_no_gap_encloses_more_than_its_root_mean_square_allows(amplitudes, onset):
    """A gap that is there in one record alone, up and down beyond a torque. The planted fault weighs records alike."""
    for own in amplitudes:
        torque = {t: t * np.interp(np.linspace(0, 5, 5001), range(6), [0, 1, 0, -1, 0, 1]) for t in amplitudes}
        step = {t: np.diff(q) for t, q in torque.items()}
        gap = {t: np.where((t == own) & (torque[t][1:] > onset * t), np.sign(step[t]), 0.0) for t in amplitudes}
        travelled = sum(np.abs(s).sum() for s in step.values())
        rms = np.sqrt(sum(np.abs(step[t]) @ gap[t] ** 2 for t in amplitudes) / travelled)
        cycle = slice(1000, 5000)
        area = abs(step[own][cycle] @ gap[own][cycle])
        assert 0.0 < area <= largest_enclosed_j(rms, own, travelled) * (1 + 1e-9)
        if own == 0.2 and onset < 0.0:
            assert area > 4.0 * own * rms * np.sqrt(len(amplitudes))


@pytest.mark.parametrize(("sds", "some"), [(4.0, True), (1.8, False)])
def test_between_two_limits_a_median_is_accepted_where_both_are_kept(sds, some):
    """The planted fault guards against either limit alone: it would accept a unit that is within both with 0.93."""
    both = Limit("loop_area_J", lo=AREA - sds * SD, hi=AREA + sds * SD, rate=0.05, where="w")
    row = judge(both)["limits"][0]
    assert bool(row["accept_median_between"]) == some == (row["verdict"] == "accepted")
    if some:
        lo, hi = row["accept_median_between"]
        assert both.lo < lo < AREA < hi < both.hi
    else:
        assert both.lo + row["guard_band"]["above_min"] < row["median"] < both.hi - row["guard_band"]["below_max"]


def test_given_models_share_what_the_diagnosis_leaves_them():
    """The planted fault was to forget the diagnosis where models are given: what was open was accepted."""
    unexplained = evidence(diagnosis=diagnosis(["unknown"], unknown=0.97, none=0.03))
    assert assess([unexplained, evidence()], Limits((area(3),)), [0.3, 0.7])["verdict"] == "inconclusive"
    half = assess([unexplained, evidence()], Limits((area(3),)), [0.3, 0.2])["structure"]
    assert half["uncovered"] == pytest.approx({"unknown": 0.97, "models not given": 0.015})
    assert [m["probability"] for m in half["models"]] == pytest.approx([0.009, 0.006])


def test_what_is_in_no_model_is_counted_once_an_answer():
    """Two effects that act together with 0.6 are not held with 0.6: not with the sum of a half each."""
    both = "sensor_lag+viscoelastic_creep"
    pair = evidence(diagnosis=diagnosis(both.split("+"), **{both: 0.6, "none": 0.4}))
    assert judge(area(3), e=pair)["structure"]["uncovered"] == {both: 0.6}
    single = evidence(diagnosis=diagnosis(["sensor_lag"], **{"sensor_lag": 0.35, both: 0.2, "none": 0.3}))
    told = judge(area(3), e=single)
    assert told["verdict"] == "inconclusive" and told["structure"]["unknown_probability"] == pytest.approx(0.55)
    with pytest.raises(BadInput, match="none of slip"):
        judge(area(3), e=evidence(diagnosis=diagnosis(["slip"], none=1.0)))
