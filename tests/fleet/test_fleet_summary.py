"""What a fleet looks like: charts, drift, batches, units to look at; plain JSON."""

import json

import numpy as np
import pytest
from support.fleet_units import row

from backdrive_bayes.fleet.summary import summarise

CHARTED = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")


def units(values, **about):
    """Units in a shuffled order, serials in that of the values; ``about`` gives a list a key."""
    found = []
    for i, value in enumerate(values):
        own = {key: some[i] for key, some in about.items()}
        rows = [{"unit": f"u{i}", "status": "done", "error": None} | row(f"u{i}", value, serial=f"no. {i}", **own)]
        found.append((f"u{i}", f"key{i}", rows))
    return [found[i] for i in np.random.default_rng(0).permutation(len(found))]


@pytest.fixture
def steady():
    """A process without outliers."""
    return 1.0 + 0.0173 * np.random.default_rng(1).uniform(-1, 1, 40)


def test_units_are_charted_in_order_of_their_serials_as_numbers(steady):
    result = summarise(units(steady))
    assert result["order"] == "serial" and [u["unit"] for u in result["charted"]] == [f"u{i}" for i in range(40)]
    chart = result["charts"][0]
    assert chart["median"] == steady.tolist() and set(chart["centre"]) == {np.median(steady)}
    assert chart["sigma"] == pytest.approx(0.01, rel=0.35) and not chart["outside"] and not chart["drift"]["alarm"]
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_a_shift_is_an_alarm_and_not_forty_outliers(steady):
    steady[25:] += 0.05
    result = summarise(units(steady))
    for chart in result["charts"]:
        assert chart["drift"]["alarm"] and chart["drift"]["first"] == "u25" and len(set(chart["centre"])) == 2
        assert len(chart["outside"]) <= 2


def test_an_outlier_is_a_unit_to_look_at_and_leads_to_its_file(steady):
    steady[7] += 0.2
    result = summarise(units(steady))
    assert result["charts"][0]["outside"] == ["u7"] and not result["charts"][0]["drift"]["alarm"]
    assert result["worst"][0]["unit"] == "u7" and result["worst"][0]["result"] == "units/key7.json"


def test_rejected_units_come_first_by_their_conformance(steady):
    verdict, p = ["accepted"] * 40, [0.99] * 40
    for i, probability in ((3, 0.2), (9, 0.01)):
        verdict[i], p[i] = "rejected", probability
    found = summarise(units(steady, verdict=verdict, conformance_probability=p, limiting=["loop_area_J"] * 40))
    assert found["verdicts"] == {"accepted": 38, "rejected": 2}
    assert [w["unit"] for w in found["worst"]][:2] == ["u9", "u3"]


def test_batches_that_differ_are_told_from_those_that_do_not(steady):
    batch = ["old"] * 20 + ["new"] * 20
    same = summarise(units(steady, batch=batch))["batches"]
    assert [(r["batch"], r["units"]) for r in same["rows"]] == [("old", 20), ("new", 20)]
    assert all(p > 0.01 for p in same["probability"].values())
    steady[20:] += 0.02
    assert all(p < 1e-4 for p in summarise(units(steady, batch=batch))["batches"]["probability"].values())
    assert summarise(units(steady))["batches"] is None


def test_a_unit_in_a_folder_is_of_that_batch(steady):
    found = [(f"b{i % 2}/{name}", key, rows) for i, (name, key, rows) in enumerate(units(steady))]
    for name, _, rows in found:
        rows[0]["unit"] = name
    assert {r["batch"] for r in summarise(found)["batches"]["rows"]} == {"b0", "b1"}


def test_rated_torques_as_read_from_bare_records_are_one(steady):
    """Of a bare record the largest torque read stands for T_r, noise and all; the planted fault wants them equal."""
    found, rng = units(steady), np.random.default_rng(0)
    for _, _, rows in found:
        for one in rows:
            one["rated_torque_Nm"] = 0.1 * (1 + 0.001 * rng.standard_normal())
    assert summarise(found)["loop"]["units"] == len(found)


def test_units_that_cannot_be_compared_are_left_out_and_counted(steady):
    found = units(steady)
    changes = {"converged": False, "forced": True, "rated_torque_Nm": 2.0, "amplitude_Nm": 0.5, "loop_area_J": None}
    for i, (key, value) in enumerate(changes.items()):
        found[i][2][0][key] = value
    found.append(("bad", "k", [{"unit": "bad", "status": "failed", "error": "no cycle", "data_sha256": None}]))
    result = summarise(found)
    assert (result["loop"]["units"], result["loop"]["left_out"]) == (35, 5)
    assert result["counts"] == {"units": 41, "done": 40, "failed": 1, "set_aside": 0, "converged": 39, "forced": 1}
    assert result["failures"] == [{"unit": "bad", "status": "failed", "error": "no cycle"}]


def test_few_units_and_none_have_no_limits():
    result = summarise(units([1.0, 1.1, 5.0]))
    assert all(c["drift"] is None and c["sigma"] == 0 and not c["outside"] for c in result["charts"]) and not result["worst"]
    nothing = summarise([("bad", "k", [{"unit": "bad", "status": "failed", "error": "x", "data_sha256": None}])])
    assert not nothing["charts"] and nothing["batches"] is None and nothing["loop"] is None


def test_units_of_one_name_are_told(steady):
    found = units(steady)
    for i in (0, 1):
        found[i][2][0]["name"] = "same"
    assert summarise(found)["same_names"] == {"same": [found[0][0], found[1][0]]}


def test_the_order_is_the_first_that_every_unit_has_or_the_one_asked_for(steady):
    dates = [f"2026-01-{40 - i:02d}" for i in range(40)]
    assert summarise(units(steady, test_date=dates))["charted"][0]["unit"] == "u39"
    assert summarise(units(steady, test_date=dates), "serial")["charted"][0]["unit"] == "u0"
    assert summarise(units(steady, test_date=[None, *dates[1:]]))["order"] == "serial"
