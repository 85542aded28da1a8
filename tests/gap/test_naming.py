"""What is planted in a unit of the class is named; of a clean one nothing is."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.planted import (
    LOOPS,
    MORE,
    NOISE,
    PERIOD_RAD,
    UNITS,
    UNLISTED,
    VARIANTS,
    changed,
    planted,
    prepared,
    smooth_reducer,
    stepped,
    teeth,
)

from backdrive_bayes.engine import jumps, periodic, reduced
from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.traces import trace_levels
from backdrive_bayes.gap import probabilities as gap
from backdrive_bayes.gap import table
from backdrive_bayes.gap.hypotheses import weigh
from backdrive_bayes.gap.properties import find_properties

SYMMETRY_BREAKERS = [n for n in UNITS if n not in ("none", "second_backlash", "interface_slip")]


@cache
def found(name):
    """What was weighed in a unit, the properties of its operator and the joint probabilities."""
    weighed = weigh(prepared(name))
    properties = {p.name: p for p in find_properties(weighed, np.random.default_rng(0))}
    joint = weighed.joint({n: p.probability for n, p in properties.items()})
    return weighed, properties, joint


@pytest.mark.parametrize("name", UNITS)
def test_the_planted_name_is_the_likeliest(name):
    answers = gap.labels(found(name)[2])
    assert next(iter(answers)) == name and answers[name] > 0.45
    assert name in gap.credible_set(answers)


@pytest.mark.parametrize("name", UNITS)
def test_probabilities_sum_to_one(name):
    _, _, joint = found(name)
    assert sum(joint.values()) == pytest.approx(1.0) and min(joint.values()) >= 0.0
    answers = gap.labels(joint)
    assert sum(answers.values()) == pytest.approx(1.0) and list(answers.values()) == sorted(answers.values(), reverse=True)
    assert sum(answers[n] for n in gap.credible_set(answers)) >= gap.CALIBRATION.cover
    assert gap.unlisted(joint) == pytest.approx(answers["unknown"])


@pytest.mark.parametrize("name", SYMMETRY_BREAKERS)
def test_what_breaks_a_symmetry_has_evidence_that_a_clean_unit_has_not(name):
    clean, there = found("none")[0], found(name)[0]
    assert there.log_factor[(name,)] > 15 and clean.log_factor[(name,)] < 3
    assert max(clean.log_factor.values()) < 4
    # A wander of the reading explains a part of a single step, and all of a drift, though it is far less likely.
    more = there.left[()] - clean.left[()]
    if name == "unknown":
        # How much of a step is left depends on where knots are.
        larger = weigh(prepare(stepped(1.6e-3))).left[()] - clean.left[()]
        assert min(more, larger) > 0.2 and 0.5 * (more + larger) > 0.3
    else:
        assert name == "thermal_drift" or more > 1


@pytest.mark.parametrize("name", [n for n in VARIANTS if n != "teeth_back"])
def test_other_forms_of_an_effect_are_named_with_nothing_beside(name):
    """Teeth of stick-slip; a wave with few periods and strong harmonics; creep under the square of the load."""
    weighed = weigh(prepare(VARIANTS[name]()))
    answers = gap.labels(weighed.joint())
    assert next(iter(answers)) == name and answers[name] > 0.4
    assert max(weighed.log_factor.values()) < weighed.log_factor[(name,)] + 2


@pytest.mark.parametrize("name", UNLISTED)
def test_what_is_unlisted_is_unknown_by_a_kind_of_its_own(name, monkeypatch):
    """It is likelier than all names together. A planted fault: without the kind, and shapes that could draw it, a listed effect
    stands for it."""
    unit = UNLISTED[name]()
    weighed = weigh(prepare(unit))
    answers = gap.labels(weighed.joint())
    assert answers["unknown"] > 0.5
    for kinds in ("TOGETHER", "ALONE"):
        monkeypatch.setattr(table, kinds, tuple(k for k in getattr(table, kinds) if k not in (name, "shape")))
    wrong = weigh(prepare(replace(unit, name="again")))
    assert wrong.log_factor[("unknown",)] < weighed.log_factor[("unknown",)] - 5
    assert max(wrong.log_factor, key=wrong.log_factor.get) != ("unknown",)


def test_teeth_that_leap_back_are_no_stick_slip():
    """A planted fault: on every leg the angle runs ahead and leaps back."""
    weighed = weigh(prepare(VARIANTS["teeth_back"]()))
    assert weighed.log_factor[("stick_slip",)] < 0


@pytest.mark.parametrize("name", ["thermal_drift", "sensor_lag"])
def test_what_acts_beside_stick_slip_is_named_with_it(name):
    """A planted fault: leaps that count among the contrasts drown a drift beside them."""
    weighed = weigh(prepare(changed(UNITS[name](), lambda r, i: teeth(r))))
    both = "+".join(sorted(("stick_slip", name)))
    answers = gap.labels(weighed.joint())
    assert next(iter(answers)) == both and answers[both] > 0.5
    seen = dict.fromkeys(weighed.leaps, 1e-9)
    wrong = gap.labels(gap.probabilities(weighed.log_factor, seen, weighed.disturbance, weighed.left, {}))
    assert wrong[both] < answers[both] - (0.3 if name == "thermal_drift" else 0.01)
    # Teeth that do not scatter the block means cost no more than not to have known that.
    assert weighed.log_factor[("stick_slip",)] > weighed.leaps[("stick_slip",)] - 0.7


@pytest.mark.parametrize(("teeth_factor", "with_process", "expected"), [(5.0, 3.0, 2.43), (5.0, -3.0, 0.33), (-0.5, 3.0, 1.0)])
def test_teeth_that_were_found_scatter_the_block_means_or_not(teeth_factor, with_process, expected, monkeypatch):
    """Both are as likely before; what is left is judged beside the likelier one."""
    weighed = table.Table(prepared("none")[0], jumps.Jumps(teeth_factor, 1e-4))
    monkeypatch.setattr(weighed, "_of_kinds", lambda hypothesis, on: with_process if "unknown" in on else 1.0)
    assert weighed.log_marginal(("stick_slip",)) == pytest.approx(expected, abs=0.01)
    assert ("unknown" in weighed.on[("stick_slip",)]) == (expected > 2.0)


@pytest.mark.parametrize(("whole", "instead", "expected"), [(1.0, 5.0, 4.33), (5.0, 1.0, 4.33), (3.0, 3.0, 3.0)])
def test_flanks_differ_in_either_of_two_forms(whole, instead, expected, monkeypatch):
    """Both are as likely before; what is left is judged beside the likelier one."""
    weighed = table.Table(prepared("none")[0], jumps.Jumps(0.0, 0.0))
    monkeypatch.setattr(weighed, "_of_kinds", lambda hypothesis, on: instead if "unequal_deflection" in on else whole)
    assert weighed.log_marginal(("asymmetric_stiffness",)) == pytest.approx(expected, abs=0.01)
    assert weighed.on[("asymmetric_stiffness",)] == ({"unequal_deflection"} if instead > whole else {"asymmetric_stiffness"})


def test_a_flank_on_which_all_turns_further_is_asymmetric(monkeypatch):
    """A planted fault: elastic deflection alone, even in the torque, is less likely."""
    name = ("asymmetric_stiffness",)

    def soft(size, label):
        further = changed(UNITS["none"](), lambda r, i: size * np.clip(r.angle_rad - np.mean(r.angle_rad), 0.0, None))
        return weigh(prepare(replace(further, name=label)))

    little, much = soft(0.05, "little"), soft(0.1, "much")
    for weighed in (little, much):
        assert next(iter(gap.labels(weighed.joint()))) == name[0]
        assert weighed.log_factor[name] > weighed.log_factor[("unknown",)] + 3
    monkeypatch.setattr(table, "_forms", lambda terms: [{t.name for t in terms if not t.instead}])
    for size, weighed, less in ((0.05, little, 2), (0.1, much, 3)):
        assert soft(size, "again").log_factor[name] < weighed.log_factor[name] - less


@pytest.mark.parametrize(("hertz", "size", "named"), [(50.0, 4e-4, True), (50.0, 2e-5, False)])
def test_a_hum_in_the_samples_is_something_unlisted(hertz, size, named):
    """The means of blocks do not show it; a line no higher than any bench's resonance is not named."""
    humming = changed(UNITS["none"](), lambda r, i: size * np.sin(2 * np.pi * hertz * r.time_s))
    weighed = weigh(prepare(humming))
    answers = gap.labels(weighed.joint())
    assert (answers["unknown"] > 0.6) == named and (answers["unknown"] < 0.4) == (not named)


def test_the_period_of_the_wave_is_found():
    weighed = found("encoder_error")[0]
    period = weighed.linear.reduced.angle_scale_rad / weighed.frequency[("encoder_error",)]
    assert period == pytest.approx(PERIOD_RAD, rel=0.03)
    other = found("none")[0]
    assert other.linear.reduced.angle_scale_rad / other.frequency[("encoder_error",)] != pytest.approx(PERIOD_RAD, rel=0.03)


def _waving(turns, zeros=(0.0, 0.0)):
    """A unit with an encoder's wave of so many periods over its range, each record read from a zero of its own [angle ranges]."""
    span = float(np.ptp(UNITS["none"]().records[0].angle_rad))
    wave = lambda r: 4e-4 * np.cos(2 * np.pi * turns * r.angle_rad / span)  # noqa: E731
    return changed(UNITS["none"](), lambda r, i: wave(r) + zeros[i] * span)


def test_an_encoder_that_was_zeroed_anew_errs_at_other_angles(monkeypatch):
    """A planted fault: one phase for both records explains little of it."""
    unit = _waving(6.0, (0.0, 0.24))
    weighed = weigh(prepare(unit))
    assert next(iter(gap.labels(weighed.joint()))) == "encoder_error"
    monkeypatch.setattr(periodic, "phases", lambda linear: 1)
    monkeypatch.setattr(table, "phases", lambda linear: 1)
    wrong = weigh(prepare(replace(unit, name="again")))
    assert wrong.log_factor[("encoder_error",)] < 0.6 * weighed.log_factor[("encoder_error",)]


def test_a_wave_of_one_and_a_half_periods_and_a_soft_flank_are_told_apart_by_their_evidence():
    weighed = weigh(prepare(_waving(1.5)))
    # What is unlisted holds a wave as slow as that, too.
    wave, answers = {h: v for h, v in weighed.log_factor.items() if "unknown" not in h}, gap.labels(weighed.joint())
    assert max(wave, key=wave.get) == ("encoder_error",) and wave[("encoder_error",)] > wave[("asymmetric_stiffness",)] + 3
    assert "encoder_error" in gap.credible_set(answers)
    soft = found("asymmetric_stiffness")[0].log_factor
    assert soft[("asymmetric_stiffness",)] > soft[("encoder_error",)] + 3


@pytest.mark.parametrize(("name", "size", "torque"), [("second_backlash", 0.15, 0.3), ("interface_slip", 0.1, None)])
def test_properties_are_found_on_units_that_have_them_and_not_on_others(name, size, torque):
    here, elsewhere = found(name)[1][name], found("none")[1][name]
    # Half of the loops that look like slip have none: its probability ends at a half.
    assert here.probability > (0.5 if name == "interface_slip" else 0.9) and elsewhere.probability < 0.35
    assert np.median(here.size_rad) == pytest.approx(0.02 * size, rel=0.35)
    assert torque is None or here.torque_nm == pytest.approx(0.1 * torque, rel=0.1)
    other = "interface_slip" if name == "second_backlash" else "second_backlash"
    assert found(name)[1][other].probability < 0.35
    weighed, _, joint = found(name)
    assert joint[("unknown",)] < 0.1 and next(iter(gap.labels(joint))) == name and max(weighed.log_factor.values()) < 4


def test_effects_that_are_not_allowed_are_not_weighed():
    weighed = weigh(prepared("torque_offset"), ("sensor_lag", "thermal_drift"))
    named = {n for h in weighed.log_factor for n in h}
    assert named == {"sensor_lag", "thermal_drift", "unknown"}


def test_an_early_angle_is_no_lag():
    """A planted fault: the torque channel is late. What the name stands for is one way, as strong as a lag would be."""
    late, early = found("sensor_lag")[0], weigh(prepare(planted(known=smooth_reducer(), lag_s=-0.03)))
    assert late.log_factor[("sensor_lag",)] > 15 and early.log_factor[("sensor_lag",)] < 1
    assert early.linears[0].distortion.lag_s < 1e-3
    for mode in early.linears:
        trace = trace_levels(mode.reduced, mode.design, mode.effects)["sensor_lag"]
        assert mode.log_scale["sensor_lag"] == pytest.approx(np.log(trace))


def test_one_rate_says_nothing_of_a_law_of_the_rate():
    """A name that the records cannot tell is as likely as before, not impossible."""
    one = weigh(prepare(planted(known=smooth_reducer(), loops=LOOPS[1:])))
    assert one.log_factor[("rate_dependent_friction",)] == 0.0
    joint = one.joint()
    assert joint[("rate_dependent_friction",)] == pytest.approx(joint[()] * np.exp(gap.CALIBRATION.single))


def test_weighing_again_gives_the_same_numbers():
    assert weigh(prepared("none")).log_factor == found("none")[0].log_factor


def test_zeros_of_the_torque_channel_that_differ_between_records_are_hardly_an_effect(monkeypatch):
    """By up to five times what is usual; without a zero of each record's own the jitter must stand for them."""
    unit, zeros = planted(known=smooth_reducer(), loops=MORE), NOISE.torque_nm * np.array([2.1, -2.4, 0.9, -1.5])
    moved = replace(unit, records=tuple(replace(r, torque_nm=r.torque_nm + z) for r, z in zip(unit.records, zeros, strict=True)))
    weighed = weigh(prepare(moved))
    assert max(weighed.log_factor.values()) < 5.0
    monkeypatch.setattr(reduced, "ZERO", 0.0)
    assert weigh(prepare(moved)).linears[0].jitter.torque > 2.0 * weighed.linears[0].jitter.torque
