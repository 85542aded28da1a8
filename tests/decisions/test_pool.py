"""A pooled batch as knowledge of the process: its risks against other ways to the same numbers, and what it refuses."""

import json

import numpy as np
import pytest
from support.decided import LOOPS, TYPICAL, evidence

from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.global_risk import Process, global_risks
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.decisions.pool import Pool, Predictive
from backdrive_bayes.errors import BadInput

INF, LEVEL = np.inf, 0.9
RULE = ((-INF, 1.4), (-INF, 1.25), (-INF, 1.5))
AREA = TYPICAL["loop_area_J"]


def predictive(mean, spread, log=False):
    next_unit = {"median": 1.0, "lo": 0.5, "hi": 1.5, "sd": 0.3}
    return Predictive(np.atleast_1d(mean).astype(float), np.atleast_1d(spread).astype(float), log, next_unit, 12)


def pool(refused=None, k=0.03, name="loop_area_J", spread=0.03, units=12, rate=0.051):
    """The object of a pool.json with one indicator about its typical value."""
    rng = np.random.default_rng(0)
    draws = {"mean": (np.log(TYPICAL[name]) + 0.005 * rng.standard_normal(200)).tolist(), "spread": [spread] * 200}
    next_unit = {"median": TYPICAL[name], "lo": 0.0, "hi": 1.0, "sd": 1e-5}
    quantity = {"name": name, "unit": "J", "loading_rate_Nm_per_s": rate, "amplitude_Nm": 0.1, "refused": refused,
                "units": units, "scale": "log", "predictive": draws, "next_unit": next_unit}  # fmt: skip
    return {"schema": "backdrive-bayes/pool/1", "batch": "spring", "k": k, "rated_torque_Nm": 0.1, "quantities": [quantity]}


@pytest.mark.parametrize("shape", ["normal", "lognormal"])
def test_a_known_process_has_the_risks_of_the_guide(shape):
    """One draw of mean and spread: the same integral as for a stated process, by another quadrature."""
    stated = Process(1.0, 0.3, shape)
    log = shape == "lognormal"
    spread = np.sqrt(np.log1p(0.09)) if log else 0.3
    found = predictive(-0.5 * spread**2 if log else 1.0, spread, log).risks(0.1, *RULE, LEVEL)
    for key, value in global_risks(stated, 0.1, *RULE).to_json().items():
        assert found[key] == pytest.approx(value, abs=1e-9), key


def test_an_uncertain_process_has_the_mean_of_its_risks():
    rng = np.random.default_rng(0)
    mean, spread = rng.normal(1.0, 0.05, 20), 0.25 * np.exp(0.3 * rng.standard_normal(20))
    found = predictive(mean, spread).risks(0.1, *RULE, LEVEL)
    each = [global_risks(Process(m, s), 0.1, *RULE).to_json() for m, s in zip(mean, spread, strict=True)]
    for key in each[0]:
        assert found[key] == pytest.approx(np.mean([e[key] for e in each]), abs=1e-9), key
    assert found["consumer_interval"]["lo"] < found["consumer"] < found["consumer_interval"]["hi"]


def test_against_simulated_production():
    rng = np.random.default_rng(3)
    mean, spread = rng.normal(0.0, 0.05, 200), np.abs(rng.normal(0, 0.2, 200))
    risks = predictive(mean, spread, log=True).risks(0.1, *RULE, LEVEL)
    truth = np.exp(np.repeat(mean, 5000) + np.repeat(spread, 5000) * rng.standard_normal(1_000_000))
    reading = truth + rng.normal(0, 0.1, truth.size)
    for key, hits in (
        ("consumer", (reading <= 1.25) & (truth > 1.4)), ("producer", (reading > 1.5) & (truth <= 1.4)),
        ("nonconforming", truth > 1.4), ("rejected", reading > 1.5),
    ):  # fmt: skip
        assert risks[key] == pytest.approx(hits.mean(), abs=5 * np.sqrt(max(hits.mean(), 1e-5) / truth.size)), key


def test_accepting_nothing_and_rejecting_everything():
    for found in (
        predictive(1.0, 0.3).risks(0.1, (0.9, 1.1), None, (INF, -INF), LEVEL),
        global_risks(Process(1.0, 0.3), 0.1, (0.9, 1.1), None, (INF, -INF)).to_json(),
    ):
        assert found["accepted"] == 0.0 and found["consumer"] == 0.0
        assert found["rejected"] == pytest.approx(1.0, abs=1e-6)
        assert found["producer"] == pytest.approx(1 - found["nonconforming"], abs=1e-6)


def test_a_verdict_takes_its_global_risks_from_the_pool(tmp_path):
    folder = tmp_path / "spring"
    folder.mkdir()
    (folder / "pool.json").write_text(json.dumps(pool()))
    limit = Limit("loop_area_J", hi=1.03 * AREA, rate=0.05, where="limits.toml")
    row = assess([evidence(loops=LOOPS)], Limits((limit,)), batch=Pool.read(folder))["limits"][0]
    found = row["global"]
    assert found["batch_units"] == 12 and found["process"]["shape"] == "pooled"
    # The limit lies one spread above the centre: 0.16 and a little more for what is not known of the process.
    assert found["nonconforming"] == pytest.approx(0.165, abs=0.01)
    assert found["consumer"] < found["nonconforming"]
    stated = Limit("loop_area_J", hi=1.03 * AREA, rate=0.05, process=Process(AREA, 0.03 * AREA), where="w")
    kept = assess([evidence(loops=LOOPS)], Limits((stated,)), batch=Pool.read(folder))["limits"][0]["global"]
    assert kept["process"]["shape"] == "normal", "what the limits file states stands"


def test_what_the_pool_does_not_hold_is_one_line():
    held = Pool(pool(), "spring/pool.json")
    assert held.predictive("loop_area_J", 0.05, 0.1, 0.003).units == 12
    with pytest.raises(BadInput, match=r"among what was pooled"):
        held.predictive("loop_area_J", 0.01, 0.1, 0.003)
    with pytest.raises(BadInput, match=r"refused: 0.4 bit are lost"):
        Pool(pool(refused="0.4 bit are lost"), "p").predictive("loop_area_J", 0.05, 0.1, 0.003)
    with pytest.raises(BadInput, match=r"expected lost motion at ±0.005 N·m, found at ±0.003"):
        Pool(pool(name="lost_motion_rad"), "p").predictive("lost_motion_rad", 0.05, 0.1, 0.005)


def test_another_file_is_no_pool(tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        Pool.read(tmp_path)
