"""From evidences to probabilities and credible sets."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.gap.candidates import MISFIT_LEVELS, UNKNOWN_KINDS, UNKNOWN_LEVELS
from backdrive_bayes.gap.evidence import FORMULA_ERRORS
from backdrive_bayes.gap.fast import Fast
from backdrive_bayes.gap.probabilities import (
    CALIBRATION,
    Evidences,
    credible_set,
    lasting,
    marginal,
    probabilities,
    unlisted,
)

QUIET = Fast({"encoder_error": -3.0, "stick_slip": -3.0, "vibration": -3.0}, {})
LEVELS = -np.geomspace(1.0, 400.0, len(MISFIT_LEVELS))[:, None] + np.zeros(len(FORMULA_ERRORS))


def candidates(unexplained=-50.0, beside=-15.0, **gains):
    """Hypotheses whose evidence beats the baseline's by the given gains; pairs are written a__b.

    Unexplained structure gains ``unexplained`` on the baseline, and ``beside`` on the best other hypothesis.
    """
    weighed = [SimpleNamespace(effects=(), log_evidence=LEVELS)]
    weighed += [SimpleNamespace(effects=tuple(k.split("__")), log_evidence=LEVELS + v) for k, v in gains.items()]
    best = max(weighed[1:], key=lambda w: w.log_evidence.max())
    flat = np.zeros((len(UNKNOWN_KINDS), len(UNKNOWN_LEVELS), len(FORMULA_ERRORS)))
    rest = {(): flat + unexplained, best.effects: flat + best.log_evidence.max() + beside}
    return SimpleNamespace(weighed=tuple(weighed), none=weighed[0], unexplained=rest)


def labels(found, fast=QUIET):
    return marginal(probabilities(Evidences.of(found, fast)))


def test_probabilities_sum_to_one_and_are_sorted():
    found = labels(candidates(sensor_lag=3.0, thermal_drift=-2.0, sensor_lag__thermal_drift=4.0))
    assert sum(found.values()) == pytest.approx(1.0)
    assert list(found.values()) == sorted(found.values(), reverse=True)


def test_without_evidence_the_baseline_explains_all():
    assert next(iter(labels(candidates(sensor_lag=-3.0, thermal_drift=-3.0)))) == "none"


def test_a_strong_effect_is_named_and_a_stronger_rest_is_unknown():
    named = labels(candidates(sensor_lag=100.0, thermal_drift=0.0))
    assert named["sensor_lag"] > 0.9
    rest = labels(candidates(sensor_lag=100.0, thermal_drift=0.0, unexplained=250.0))
    assert rest["unknown"] > 0.9


def test_what_an_effect_leaves_unexplained_makes_it_doubtful():
    found = [labels(candidates(sensor_lag=100.0, beside=v)).get("unknown", 0.0) for v in (-15.0, 5.0, 40.0)]
    assert found[0] < 0.05 and found[0] < found[1] < found[2] and found[2] > 0.9


def test_a_module_that_every_reducer_has_comes_first():
    named = labels(candidates(geometric=60.0, sensor_lag=65.0))
    assert named["geometric"] > 3 * named["sensor_lag"]
    assert labels(candidates(geometric=60.0, sensor_lag=160.0))["sensor_lag"] > 0.9


def test_something_unknown_beside_a_module_leaves_the_module_named():
    """An effect beside which something unknown acts is unknown as a whole: only modules are known to be there."""
    both = (candidates(**{name: 100.0}, beside=80.0) for name in ("geometric", "sensor_lag"))
    beside = [probabilities(Evidences.of(found, QUIET)) for found in both]
    module, effect = (marginal(joint) for joint in beside)
    assert module["geometric"] > 0.9 and "geometric+unknown" not in module and sum(module.values()) == pytest.approx(1.0)
    assert effect["unknown"] > 0.9
    assert unlisted(beside[0]) > 0.9 and unlisted(beside[1]) > 0.9
    assert unlisted(probabilities(Evidences.of(candidates(geometric=100.0, beside=-30.0), QUIET))) < 0.1
    hum = Fast({"encoder_error": -3.0, "stick_slip": -3.0, "vibration": 80.0}, {})
    assert unlisted(probabilities(Evidences.of(candidates(geometric=100.0, beside=-30.0), hum))) > 0.9


def test_what_a_search_still_gained_counts_by_temperature_and_odds():
    close, clear = candidates(sensor_lag=400.0, thermal_drift=399.0), candidates(sensor_lag=400.0, thermal_drift=300.0)
    close, clear = (Evidences.of(found, QUIET) for found in (close, clear))
    assert lasting(close, 0.0) and lasting(close, 10.0) and not lasting(close, 15.0)
    assert lasting(clear, 15.0) and not lasting(clear, 60.0)
    weak = Evidences.of(candidates(sensor_lag=1.0, thermal_drift=0.0), QUIET)
    assert lasting(weak, 2.0) and not lasting(weak, 6.0)


def test_a_pair_must_earn_its_place():
    close = labels(candidates(sensor_lag=100.0, thermal_drift=0.0, sensor_lag__thermal_drift=103.0))
    far = labels(candidates(sensor_lag=100.0, thermal_drift=0.0, sensor_lag__thermal_drift=200.0))
    assert close["sensor_lag"] > close["sensor_lag+thermal_drift"]
    assert far["sensor_lag+thermal_drift"] > 0.9


def test_fast_structure_joins_the_slow_answer_and_vibration_is_unknown():
    jumps = Fast({"encoder_error": -3.0, "stick_slip": 80.0, "vibration": -3.0}, {})
    quiet = candidates(sensor_lag=-3.0, thermal_drift=-3.0, interface_slip=-3.0)
    assert next(iter(labels(quiet, jumps))) == "stick_slip"
    assert labels(candidates(sensor_lag=100.0), jumps)["sensor_lag+stick_slip"] > 0.5
    hum = Fast({"encoder_error": -3.0, "stick_slip": -3.0, "vibration": 80.0}, {})
    assert labels(candidates(sensor_lag=100.0), hum)["unknown"] > 0.9


def test_two_effects_are_rarer_than_one_also_where_one_is_fast():
    jumps = Fast({"encoder_error": -3.0, "stick_slip": 200.0, "vibration": -3.0}, {})
    found = Evidences.of(candidates(sensor_lag=-2.0, thermal_drift=-2.0, interface_slip=-2.0), jumps)
    chosen = [replace(CALIBRATION, beside=share) for share in (0.3, 1.0)]
    alone, loose = (marginal(probabilities(found, c))["stick_slip"] for c in chosen)
    assert alone > 0.8 and loose < alone - 0.05


def test_credible_set_is_the_smallest_that_holds_the_level():
    found = {"a": 0.6, "b": 0.25, "c": 0.1, "none": 0.05}
    assert credible_set(found, 0.9) == ["a", "b", "c"]
    assert credible_set(found, 0.5) == ["a"]


def test_weights_are_as_many_as_what_they_weigh():
    c = CALIBRATION
    assert c.none + c.single + c.pair + c.unknown == pytest.approx(1.0)
    assert len(c.misfit) == len(MISFIT_LEVELS) and len(c.unknown_level) == len(UNKNOWN_LEVELS)
    assert len(c.formula) == len(FORMULA_ERRORS) and sum(c.formula) == pytest.approx(1.0)
    assert sum(c.misfit) == pytest.approx(1.0) and sum(c.unknown_level) == pytest.approx(1.0)


def test_evidences_survive_json():
    kept = Evidences.of(candidates(sensor_lag=3.0, sensor_lag__thermal_drift=4.0), QUIET)
    again = Evidences.from_json(json.loads(json.dumps(kept.as_json())))
    assert probabilities(again) == pytest.approx(probabilities(kept), abs=1e-3)


def test_fast_structure_without_a_name_in_the_library_is_unknown():
    jumps = Fast({"encoder_error": -3.0, "stick_slip": 120.0, "vibration": -3.0}, {})
    quiet = candidates(sensor_lag=-3.0, thermal_drift=-3.0)
    assert next(iter(labels(quiet, jumps.within(["stick_slip", "sensor_lag"])))) == "stick_slip"
    assert next(iter(labels(quiet, jumps.within(["encoder_error", "sensor_lag"])))) == "unknown"
    assert jumps.within(None) is jumps


def test_an_effect_that_needs_a_large_misfit_is_doubtful():
    clean = candidates(sensor_lag=100.0)
    rough = candidates(sensor_lag=100.0)
    rough.weighed[1].log_evidence = rough.weighed[1].log_evidence[::-1]
    assert labels(clean)["unknown"] < 0.05 and labels(rough)["unknown"] > 0.2


def test_what_is_not_a_number_is_no_probability():
    with pytest.raises(FloatingPointError):
        labels(candidates(sensor_lag=3.0), Fast({"encoder_error": float("nan"), "stick_slip": -3.0, "vibration": -3.0}, {}))
