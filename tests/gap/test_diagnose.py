"""The whole diagnosis on units of the virtual bench: names what is there, nothing where nothing is, unknown without the name."""

from dataclasses import replace

import numpy as np
import pytest

from backdrive_bayes.bench.plan import make_plan
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.gap import diagnose as gap_diagnose
from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.model.registry import BASELINE, candidates_beside

PLAN = make_plan(rates=(0.4, 2.0), amplitudes=(1.0,), cycles=1, sampling_hz=500.0)


def unit_with(seed, **effects):
    return draw_unit(np.random.default_rng(seed), effects, plan=PLAN).unit


@pytest.fixture(scope="module")
def lagging():
    return unit_with(5, sensor_lag=4.0)


@pytest.fixture(scope="module")
def found(lagging):
    return diagnose(lagging).json


def test_a_strong_effect_is_named_with_its_size(found):
    assert found["answer"]["effects"] == ["sensor_lag"]
    top = found["which"][0]
    assert top["probability"] > 0.5 and top["parameters"]["lag_time"]["unit"] == "s"
    assert found["gap"]["probability"] > 0.9


def test_probabilities_and_shares_sum_to_one(found):
    assert sum(w["probability"] for w in found["which"]) == pytest.approx(1)
    assert sum(c["share"] for c in found["where"]["map"]) == pytest.approx(1)
    labels = {w["effect"] for w in found["which"]}
    assert {"none", "unknown", *candidates_beside(BASELINE)} <= labels
    assert found["where"]["summary"].endswith(".")


def test_the_gap_shrinks_on_records_left_out(found):
    closed = found["shrink"]["closed_fraction"]
    assert closed["lo"] <= closed["median"] <= closed["hi"] and closed["median"] > 0.5
    assert found["shrink"]["before_rad"] > found["shrink"]["after_rad"]
    assert {row["record"] for row in found["shrink"]["records"]} == {r["file"] for r in found["records"]}


def test_without_its_name_in_the_library_the_effect_is_not_named(lagging, found):
    others = tuple(n for n in candidates_beside(BASELINE) if n != "sensor_lag")
    without = diagnose(lagging, allowed=others).json
    assert "sensor_lag" not in {w["effect"] for w in without["which"]}
    assert without["gap"]["probability"] > 0.5
    assert without["shrink"]["closed_fraction"]["median"] < found["shrink"]["closed_fraction"]["median"]


def test_nothing_is_named_where_nothing_is_missing():
    result = diagnose(unit_with(3)).json
    assert result["answer"]["effects"] == [] and result["which"][0]["effect"] == "none"


def test_no_name_where_the_search_has_not_settled(lagging, monkeypatch):
    weigh = gap_diagnose.weigh_all
    monkeypatch.setattr(gap_diagnose, "weigh_all", lambda *args: replace(weigh(*args), regained=1e3))
    result = diagnose(lagging).json
    assert "sensor_lag" in result["inconclusive"] and "--seed" in result["inconclusive"]
    assert result["answer"]["effects"] == []


def test_same_seed_same_diagnosis(lagging, found):
    again = diagnose(lagging).json
    assert {**again, "seconds": 0} == {**found, "seconds": 0}
