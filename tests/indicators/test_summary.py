"""indicators.json: complete, finite, and consistent with itself."""

import json

import numpy as np
import pytest
from support.made_posterior import made_posterior

from backdrive_bayes.indicators.draws import MOVED, RESPONSES, UNITS, IndicatorDraws
from backdrive_bayes.indicators.loop import Loops
from backdrive_bayes.indicators.summary import _loop_json, indicators_json

K, RATED = 0.6, 0.1


def intervals(node):
    """All intervals inside a JSON object."""
    if isinstance(node, dict):
        if {"median", "lo", "hi"} <= set(node):
            yield node
        for value in node.values():
            yield from intervals(value)
    elif isinstance(node, list):
        for value in node:
            yield from intervals(value)


@pytest.fixture(scope="module")
def draws():
    return IndicatorDraws(made_posterior(loops=((0.05, RATED), (0.05, 0.5 * RATED))), K)


@pytest.fixture(scope="module")
def result(draws):
    return indicators_json(draws)


def test_it_is_strict_json(result):
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_intervals_are_in_order(result):
    found = [i for i in intervals(result) if not isinstance(i["median"], list)]
    assert len(found) > 30
    assert all(i["lo"] <= i["median"] <= i["hi"] for i in found)


def test_k_is_reported_and_lost_motion_beyond_a_small_loop_is_null(result):
    assert result["k"] == K
    large, small = (r["indicators"] for r in result["records"])
    assert large["lost_motion_rad"]["median"] > 0 and small["lost_motion_rad"] is None


@pytest.mark.parametrize("record", [0, 1])
def test_the_parts_agree(result, record):
    r = result["records"][record]
    core = r["indicators"]
    ratio = core["loop_area_J"]["median"] / core["absorbed_J"]["median"]
    assert core["dissipation_ratio"]["median"] == pytest.approx(ratio, rel=0.02)
    assert r["by_amplitude"]["amplitude_Nm"][-1] == pytest.approx(r["amplitude_Nm"])
    assert r["by_amplitude"]["loop_area_J"][-1]["median"] == pytest.approx(core["loop_area_J"]["median"], rel=0.01)
    split = r["mechanism"]
    assert split["S_g_over_S"]["median"] + split["S_f_over_S"]["median"] == pytest.approx(1, abs=1e-3)
    assert r["torque_energy"]["tau1_Nm"]["median"] <= r["torque_energy"]["tau2_Nm"]["median"]
    window = r["windowed"]
    assert window["torque_Nm"] == pytest.approx(r["by_amplitude"]["amplitude_Nm"])
    for name in ("loop_area_J", "dissipation_ratio"):
        assert window[name][-1]["median"] == pytest.approx(core[name]["median"], rel=1e-6)
    assert window["max_S_J"] == window["loop_area_J"][-1] and window["min_S_J"]["hi"] < window["mean_S_J"]["lo"]


def test_two_loops_of_one_unit_agree_where_they_meet(result):
    large, small = result["records"]
    at_half = large["by_amplitude"]["loop_area_J"][4]
    assert at_half["median"] == pytest.approx(small["indicators"]["loop_area_J"]["median"], rel=0.01)


def test_parameters_come_with_what_they_mean_and_what_the_class_implies(result):
    for about in result["parameters"].values():
        assert about["definition"] and about["unit"] and about["prior_interval"]["lo"] < about["prior_interval"]["hi"]


def test_every_indicator_is_known_for_any_amplitude_and_kept_draws_are_of_all(draws):
    whole, kept = draws.all(0.05, 0.07), draws.all(0.05, 0.07, kept=True)
    assert set(whole) == set(UNITS)
    for name, values in whole.items():
        np.testing.assert_allclose(values[draws.kept], kept[name], rtol=1e-9, equal_nan=True)


def test_sensitivities_have_the_signs_of_the_mechanics(draws):
    found = {(r, p): np.median(draws.sensitivity(r, p)) for r in RESPONSES for p in MOVED}
    assert found["theta_L_rad", "clearance_rad"] > 0 and found["theta_L_rad", "compliance_rated_rad_per_Nm"] > 0
    assert found["S_g_J", "clearance_rad"] == pytest.approx(1, rel=1e-3)
    assert found["S_g_J", "drag_torque_Nm"] == pytest.approx(1, rel=0.03)
    assert found["S_f_J", "clearance_rad"] == pytest.approx(0, abs=1e-9)
    assert found["S_f_J", "friction_torque_Nm"] == pytest.approx(1, abs=0.3)
    both = found["theta_L_rad", "clearance_rad"] + found["theta_L_rad", "compliance_rated_rad_per_Nm"]
    assert both == pytest.approx(1, rel=1e-3), "the angle is linear in the weights"


def test_bands_of_a_loop_are_those_of_its_shape():
    """The planted fault: loops that differ in nothing but the encoder's zero would have a band as wide as that."""
    torque, zero = np.linspace(-1.0, 1.0, 21), np.random.default_rng(0).normal(0.0, 1e-2, (300, 1))
    found = _loop_json(Loops(torque, zero + 1e-3 * torque, zero + 1e-3 * torque + 2e-4), 0.9)
    for branch, angle in (("rising_rad", 1e-3 * torque), ("falling_rad", 1e-3 * torque + 2e-4)):
        band = {k: np.array(v) for k, v in found[branch].items()}
        assert np.ptp(band["hi"] - band["lo"]) < 1e-12 and np.max(band["hi"] - band["lo"]) < 1e-12
        np.testing.assert_allclose(band["median"] - band["median"].mean(), angle - angle.mean(), atol=1e-12)
