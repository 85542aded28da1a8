"""Comparison: differences with their probabilities, matched where allowed, refused with a reason where not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm
from support.decided import LOOPS, TYPICAL, evidence

from backdrive_bayes.decisions.comparison import compare, contrast, match, paired, unique_names
from backdrive_bayes.errors import BadInput

RNG = np.random.default_rng


def test_contrast_of_two_normals_is_the_closed_form():
    rng = RNG(1)
    first, second = 10 + rng.standard_normal(4000), 9 + rng.standard_normal(4000)
    found = contrast(first, second, 0.05, 0.9, RNG(2))
    assert found["difference"]["median"] == pytest.approx(1.0, abs=0.1)
    width = found["difference"]["hi"] - found["difference"]["lo"]
    assert width == pytest.approx(2 * norm.ppf(0.95) * np.sqrt(2), rel=0.06)
    assert found["probability_first_greater"] == pytest.approx(norm.cdf(1 / np.sqrt(2)), abs=0.02)
    total = sum(found[f"probability_{k}"] for k in ("equivalent", "clearly_greater", "clearly_less"))
    assert total == pytest.approx(1.0, abs=1e-3) and found["verdict"] == "undecided"


@pytest.mark.parametrize(
    ("mean", "spread", "verdict"),
    [(1.0, 0.005, "equivalent"), (1.2, 0.02, "greater"), (0.8, 0.02, "less"), (1.04, 0.05, "undecided")],
)
def test_plain_verdicts(mean, spread, verdict):
    rng = RNG(3)
    first, second = mean * (1 + spread * rng.standard_normal(3000)), 1 + spread * rng.standard_normal(3000)
    found = contrast(first, second, 0.05, 0.9, RNG(0))
    assert found["verdict"] == verdict and found["ratio"]["median"] == pytest.approx(mean, rel=0.02)
    turned = contrast(second, first, 0.05, 0.9, RNG(0))
    assert turned["ratio"]["median"] == pytest.approx(1 / found["ratio"]["median"], rel=0.01)
    assert turned["probability_first_greater"] == pytest.approx(1 - found["probability_first_greater"], abs=0.01)


def test_a_unit_against_itself_is_undecided_not_equal_by_its_own_draws():
    """The planted fault: draws paired with themselves would say that the difference is exactly zero."""
    values = 1 + 0.2 * RNG(4).standard_normal(2000)
    found = contrast(values, values, 0.05, 0.9, RNG(0))
    assert found["verdict"] == "undecided"
    assert found["difference"]["hi"] - found["difference"]["lo"] == pytest.approx(3.29 * 0.2 * np.sqrt(2), rel=0.1)


def test_ratios_are_left_out_where_signs_change():
    found = contrast(RNG(0).standard_normal(500), 3 + RNG(1).standard_normal(500), 0.05, 0.9, RNG(2))
    assert found["ratio"] is None and found["difference"]["median"] == pytest.approx(-3, abs=0.3)


def test_equal_draws_speak_for_neither():
    """The planted fault: counting only what is strictly greater says of two zeros that the first is surely not greater."""
    found = contrast(np.zeros(400), np.zeros(400), 0.05, 0.9, RNG(0))
    assert found["probability_first_greater"] == 0.5 and found["verdict"] == "equivalent"


def test_pairing_uses_every_draw_as_often_as_can_be():
    values = paired(np.arange(300.0), RNG(0), 1000)
    counts = np.bincount(values.astype(int), minlength=300)
    assert values.size == 1000 and counts.min() == 3 and counts.max() == 4


def test_same_conditions_are_matched_and_others_refused_with_a_reason():
    a, b = evidence("a"), evidence("b", loops=((0.05, 0.1), (0.05, 0.04), (0.5, 0.1)))
    found, refused = match(a, b)
    assert [(m.first.rate, round(m.first.amplitude, 3)) for m in found] == [(0.05, 0.1), (0.05, 0.04)]
    assert found[1].first.predicted and not found[1].second.predicted
    assert {r["unit"] for r in refused} == {"a", "b"} and all("rates cannot be predicted" in r["reason"] for r in refused)


def test_unequal_amplitudes_are_matched_by_prediction_downwards_only():
    result = compare([evidence("a", loops=((0.05, 0.1),)), evidence("b", loops=((0.05, 0.06),))])
    (pair,) = result["pairs"]
    (condition,) = pair["conditions"]
    assert condition["predicted"] == ["a"] and condition["amplitude_Nm"] == pytest.approx(0.06)
    assert not condition["not_compared"] and "absorbed_J" in condition["indicators"]
    assert "beyond the measured" in pair["refused"][0]["reason"]


def test_lost_motion_at_other_torques_is_not_compared():
    pair = compare([evidence("a"), evidence("b", k=0.04)])["pairs"][0]
    for condition in pair["conditions"]:
        assert "give the same k" in condition["not_compared"]["lost_motion_rad"]
        assert "lost_motion_rad" not in condition["indicators"] and "loop_area_J" in condition["indicators"]


def test_loops_of_about_one_amplitude_are_compared_at_one():
    """Two per cent of amplitude are four of S; the planted fault takes each unit's own."""
    less = evidence("b", loops=tuple((rate, 0.982 * amplitude) for rate, amplitude in LOOPS))
    pairs, _ = match(evidence("a"), less)
    assert [(m.first.amplitude, m.second.amplitude) for m in pairs] == 3 * [(0.1, 0.1)]
    assert not any(m.second.predicted for m in pairs), "so near, a loop counts as measured"


def test_energies_at_different_loads_are_not_compared():
    less = evidence("b", seed=1)
    less = replace(less, draws=replace(less.draws, rated_torque_nm=0.08), about=less.about | {"k": 0.03 / 0.8})
    condition = compare([evidence("a"), less])["pairs"][0]["conditions"][0]
    assert set(condition["not_compared"]) == {"theta_L_rad", "W_L_J"} and "lost_motion_rad" in condition["indicators"]


def test_nothing_in_common_is_one_clear_line():
    with pytest.raises(BadInput, match="a rate and amplitude in common") as error:
        compare([evidence("a"), evidence("b", loops=((0.5, 0.1),))])
    assert "cannot be predicted" in str(error.value)
    with pytest.raises(BadInput, match="two units or more"):
        compare([evidence()])


def test_any_number_of_units_makes_all_pairs_and_one_that_fits_nothing_is_told():
    result = compare([evidence("a"), evidence("b"), evidence("c", loops=((0.5, 0.1),))])
    assert [(p["first"], p["second"], bool(p["conditions"])) for p in result["pairs"]] == [
        ("a", "b", True), ("a", "c", False), ("b", "c", False),
    ]  # fmt: skip
    assert [u["unit"] for u in result["overlays"][0]["units"]] == ["a", "b"]


def test_units_of_one_name_are_told_apart():
    assert unique_names([evidence("a"), evidence("b"), evidence("a")]) == ["a (1)", "b", "a (2)"]


def test_the_mechanism_says_how_energy_goes():
    records = compare([evidence("a"), evidence("b")])["mechanism"][0]["records"]
    assert len(records) == len(LOOPS)
    shares = [records[0][k]["median"] for k in ("S_g_over_S", "S_f_over_S", "rest_over_S")]
    assert sum(shares) == pytest.approx(1.0, abs=0.01)
    assert records[0]["elastic_share"]["median"] == pytest.approx(TYPICAL["elastic_share"], rel=0.01)


def test_not_converged_makes_every_verdict_inconclusive():
    result = compare([evidence("a"), evidence("b", converged=False, loop_area_J=1.0)])
    rows = [r for c in result["pairs"][0]["conditions"] for r in c["indicators"].values()]
    assert not result["converged"] and {r["verdict"] for r in rows} == {"inconclusive"}


def test_the_same_seed_gives_the_same_comparison():
    one, other = (compare([evidence("a"), evidence("b")], seed=3)["pairs"] for _ in range(2))
    assert one == other
