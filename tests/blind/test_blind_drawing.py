"""What is drawn, and where its truth lies."""

from collections import Counter

import numpy as np
import pytest

from backdrive_bayes.bench.plan import make_plan
from backdrive_bayes.bench.registry import MEMBERS
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.blind.drawing import assignments, draw_and_write, put
from backdrive_bayes.blind.key import folder_digest
from backdrive_bayes.blind.request import CLASSES, LISTED, Request
from backdrive_bayes.blind.where import BRANCHES, branch_index, overlap, true_map
from backdrive_bayes.errors import BadInput

PLAN = make_plan((1.0, 5.0), sampling_hz=200.0)


def test_every_class_and_severity_is_dealt_evenly_and_in_random_order():
    effects = assignments(Request(400))
    kinds = Counter("none" if not e else "pair" if len(e) > 1 else next(iter(e)) for e in effects)
    assert set(kinds) == set(CLASSES) and len(effects) == 400
    assert kinds["none"] == kinds["unknown"] == 60 and kinds["pair"] == 40
    cells = Counter(tuple(e.items()) for e in effects if len(e) == 1 and "unknown" not in e)
    assert len(cells) == 4 * len(LISTED) and set(cells.values()) == {6}
    assert not any(name in MEMBERS for e in effects for name in e)
    assert effects == assignments(Request(400)) != assignments(Request(400, seed=1))


@pytest.mark.parametrize("seed", range(20))
def test_few_units_are_dealt_evenly_too(seed):
    """Of the cards of every class and severity, the fault that was there, some class had none."""
    effects = assignments(Request(40, seed=seed))
    singles = Counter(name for e in effects if len(e) == 1 for name in e if name in LISTED)
    assert set(singles) == set(LISTED) and max(singles.values()) - min(singles.values()) <= 1
    for kind in (lambda e: len(e) == 1 and "unknown" not in e, lambda e: len(e) == 2, lambda e: "unknown" in e):
        severities = Counter(max(e.values()) for e in effects if kind(e))
        assert max(severities.values()) - min(severities.get(s, 0) for s in Request(1).severities) <= 2


def test_fewer_classes_leave_their_share_to_the_others():
    effects = assignments(Request(30, severities=(1.0,), classes=("none", "sensor_lag")))
    assert Counter(tuple(e) for e in effects) == {(): 6, ("sensor_lag",): 24}
    assert all(
        len(e) == 2 and set(e) <= {"sensor_lag", "stick_slip"}
        for e in assignments(Request(3, classes=("sensor_lag", "stick_slip", "pair")))
        if len(e) > 1
    )
    assert all(assignments(Request(5, classes=("unknown",))))


@pytest.mark.parametrize(
    "wrong",
    [
        {"units": 0},
        {"severities": (0.0,)},
        {"severities": (1.0, 1.0)},
        {"severities": (float("nan"),)},
        {"classes": ("slip",)},
        {"classes": ("hardening_stiffness",)},
        {"classes": ()},
        {"classes": ("pair", "sensor_lag")},
        {"plan": "long"},
    ],
)
def test_a_request_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(BadInput):
        Request(**{"units": 5} | wrong)


def test_the_same_request_gives_the_same_bytes_and_truth(tmp_path):
    request = Request(1, plan="quick", seed=4)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first, second = (draw_and_write(request, 0, {"sensor_lag": 0.4}, tmp_path / name) for name in ("a", "b"))
    assert first == second and first["folder_sha256"] == folder_digest(tmp_path / "b" / "unit-0001")
    assert first["label"] == "sensor_lag" and first["severity"] == 0.4 and first["height"] > 0
    assert sorted(first["where"]) == ["effect", "remainder"] and len(first["indicators"]) == 2
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["unit-0001"]
    (tmp_path / "c").mkdir()
    other = draw_and_write(request, 0, {"sensor_lag": 1.0}, tmp_path / "c")
    assert other["folder_sha256"] == folder_digest(tmp_path / "c" / "unit-0001") != first["folder_sha256"]
    put(tmp_path / "c" / "unit-0001", tmp_path / "a" / "unit-0001", other["folder_sha256"])
    assert folder_digest(tmp_path / "a" / "unit-0001") == other["folder_sha256"]


def test_branches_of_one_cycle_follow_each_other():
    torque = np.interp(np.linspace(0, 4, 401), [0, 1, 2, 3, 4], [0.0, 1.0, 0.0, -1.0, 0.0])
    runs = branch_index(torque)[[50, 150, 250, 350]]
    assert [BRANCHES[i] for i in runs] == ["load+", "unload+", "load-", "unload-"]


def test_the_true_map_sums_to_one_and_overlaps_itself():
    bench = draw_unit(np.random.default_rng(5), {"thermal_drift": 1.0}, plan=PLAN)
    truth = true_map(bench, "effect_rad")
    assert sum(sum(map(sum, r["share"].values())) for r in truth) == pytest.approx(1.0, abs=1e-3)
    cells = [
        {"record": r["record"], "branch": b, "torque_lo_Nm": lo, "torque_hi_Nm": hi, "share": s}
        for r in truth
        for b, shares in r["share"].items()
        for lo, hi, s in zip(r["edges_Nm"][:-1], r["edges_Nm"][1:], shares, strict=True)
    ]
    assert overlap(truth, cells) == pytest.approx(1.0, abs=1e-3)


def test_the_true_map_lies_where_the_curve_is():
    bench = draw_unit(np.random.default_rng(5), {"thermal_drift": 1.0}, plan=PLAN)
    for record in bench.truth.records:
        high = record.torque_nm > 0.85 * record.torque_nm.max()
        record.effect_rad[:] = np.where(high & (branch_index(record.torque_nm) == BRANCHES.index("unload+")), 1.0, 0.0)
    for record in true_map(bench, "effect_rad"):
        assert record["share"]["unload+"] == pytest.approx([0, 0, 0, 0, 0.5], abs=0.06)
        assert not any(any(shares) for branch, shares in record["share"].items() if branch != "unload+")
        assert record["edges_Nm"][-1] == pytest.approx(bench.unit.rated_torque_nm)


def test_a_fast_record_counts_as_much_as_a_slow_one():
    bench = draw_unit(np.random.default_rng(5), {"thermal_drift": 1.0}, plan=PLAN)
    for record in bench.truth.records:
        record.effect_rad[:] = 1.0
    sums = [sum(map(sum, r["share"].values())) for r in true_map(bench, "effect_rad")]
    assert sums == pytest.approx([0.5, 0.5], abs=0.02)


def test_nothing_planted_has_no_map():
    assert true_map(draw_unit(np.random.default_rng(1), {}, plan=PLAN), "remainder_rad") is None
