"""The study that makes labelled units: its mix, its folders and its key."""

import json
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from backdrive_bayes.bench.plan import make_plan
from backdrive_bayes.bench.registry import MEMBERS
from backdrive_bayes.bench.sliders import MECHANICS
from backdrive_bayes.records.unit_folder import read_unit

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "studies"))

import make_bench


def test_the_mix_is_as_told():
    dealt = make_bench.deal(MECHANICS, 200, np.random.default_rng(0))
    kinds = Counter(
        "pair" if len(e) == 2 else "none" if not e else "unlisted" if next(iter(e)) in MECHANICS.unlisted else "single"
        for e in dealt
    )
    assert kinds == {"none": 60, "single": 80, "unlisted": 30, "pair": 30}
    assert {s for e in dealt for s in e.values()} == set(make_bench.SEVERITIES)
    assert set(MEMBERS).isdisjoint(name for e in dealt for name in e)
    assert not any(make_bench.deal(MECHANICS, 5, np.random.default_rng(0), clean=True))


def test_where_an_effect_lies_is_told_by_quarters_and_thirds():
    z = np.zeros((2, 1201))
    z[1, 10:30] = 3.0
    shares = make_bench.where(z, make_plan((0.1, 1.0)))
    assert np.shape(shares) == (2, 5, 3) and shares[1][0][0] == pytest.approx(1.0)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    out = tmp_path_factory.mktemp("made")
    make_bench.main([str(out), "--units", "4", "--seed", "5"])
    return out, json.loads((out / "key.json").read_text())


def test_every_case_is_a_unit_with_its_truth(made):
    out, key = made
    assert sorted(key) == ["case-01", "case-02", "case-03", "case-04"]
    for name, truth in key.items():
        unit = read_unit(out / name)
        assert unit.rated_torque_nm == pytest.approx(truth["tr"]) and truth["kind"] in MECHANICS.kinds
        assert [r.name for r in unit.records] == [r["file"] for r in truth["records"]]
        for record in unit.records:
            own = truth["indicators"][f"{record.loading_rate_nm_per_s:g}"]
            assert set(own) == set(make_bench.INDICATORS.values()) and 0 < own["dissipation_ratio"] < 1
        held = truth["held"]
        assert {len(held[k]) for k in ("time", "torque", "angle", "angle_without")} == {841}
        assert bool(truth["effects"]) == (truth["rms_over_noise"] > 0) == (truth["where"] is not None)


def test_the_same_arguments_give_the_same_bytes(made, tmp_path):
    out, key = made
    job = (tmp_path, "sliders", 5, 0, "case-01", make_bench.deal(MECHANICS, 4, np.random.default_rng([5, 7]))[0])
    _, again, _ = make_bench.make(job)
    assert json.loads(json.dumps(again)) == key["case-01"]
    for path in (out / "case-01").iterdir():
        assert path.read_bytes() == (tmp_path / "case-01" / path.name).read_bytes()
