"""With known truth the realised consumer's risk stays at the agreed one; intervals that are half as wide are found out."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom, norm
from support.made_posterior import known

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))
from acceptance_risk import CONSUMER, PRODUCER, tally, true_indicators  # noqa: E402

UNITS = 300


@pytest.fixture(scope="module")
def measured():
    """Units measured with a normal error of known size: a calibrated posterior without any fit."""
    rng = np.random.default_rng(11)
    shape = norm.ppf((np.arange(300) + 0.5) / 300)
    out = []
    for seed in range(UNITS):
        truth, u = rng.normal(10, 1), rng.uniform(0.05, 0.2)
        estimate = truth + u * rng.standard_normal()
        draws = (estimate + u * shape).tolist()
        own = {"truth": truth, "draws": draws, "naive": estimate + 2 * u}
        out.append({"seed": seed, "converged": True, "indicators": {"x": own}})
    return out


def most(agreed):
    """Wrong decisions among as many units that chance allows once in ten thousand."""
    return binom.ppf(0.9999, UNITS, agreed) / UNITS


def test_realised_risks_stay_at_the_agreed_ones(measured):
    found = tally(measured)
    for kind, agreed in (("consumer_risk", CONSUMER), ("producer_risk", PRODUCER)):
        assert found[kind]["share"] <= most(agreed) and found[f"{kind}_near"]["share"] <= most(agreed)
        assert found[kind]["share"] == pytest.approx(found[kind]["stated"], abs=0.01), "risks are as large as is said"
    assert 0.25 < found["accepted_share"] < 0.5 and found["inconclusive_share"] < 0.45


def test_halved_intervals_fail(measured):
    found = tally(measured, factor=0.5)
    assert found["consumer_risk_near"]["share"] > most(CONSUMER) and found["producer_risk_near"]["share"] > most(PRODUCER)
    assert found["consumer_risk"]["share"] > 1.5 * found["consumer_risk"]["stated"]


def test_the_naive_decision_passes_more_units_that_are_out(measured):
    def with_median(result):
        own = result["indicators"]["x"]
        return result | {"indicators": {"x": own | {"naive": float(np.median(own["draws"]))}}}

    found = tally([with_median(r) for r in measured])
    assert found["naive_consumer_risk"] > 2 * found["consumer_risk"]["share"]


def test_what_did_not_converge_is_inconclusive(measured):
    found = tally([r | {"converged": False} for r in measured[:5]])
    assert found["inconclusive_share"] == 1.0 and found["consumer_risk"]["share"] is None


def test_true_indicators_know_the_delayed_part():
    plain, delayed = (true_indicators(known(), late) for late in (False, True))
    assert delayed["loop_area_J"] > plain["loop_area_J"] and delayed["peak_angle_rad"] > plain["peak_angle_rad"]
