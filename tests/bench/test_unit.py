"""Whole units of the virtual benches: determinism, severity, truth, files, speed, and independence of the inference."""

import ast
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from backdrive_bayes.bench import severity as ruler
from backdrive_bayes.bench.channel_noise import draw_noise
from backdrive_bayes.bench.plan import Loop, Plan, draw_past, make_path, make_plan, random_plan
from backdrive_bayes.bench.protocol import Circumstances
from backdrive_bayes.bench.registry import unlisted_names
from backdrive_bayes.bench.sliders import MECHANICS
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.bench.writing import truth_json, write_unit
from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.unit_folder import read_unit

QUICK = make_plan((0.5, 5.0), sampling_hz=500.0)
BENCH = Path(__file__).resolve().parents[2] / "backdrive_bayes" / "bench"
ALLOWED = {*sys.stdlib_module_names, "numpy", "scipy", "numba", "mujoco", "threadpoolctl"}
OWN = ("backdrive_bayes.bench", "backdrive_bayes.records.record", "backdrive_bayes.errors")


def unit(effects=None, seed=0, plan=QUICK, **more):
    return draw_unit(np.random.default_rng(seed), effects, plan=plan, **more)


def foreign_imports(source):
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "." * node.level)
    return {n for n in names if n.split(".")[0] not in ALLOWED and not n.startswith(OWN)}


def test_the_bench_shares_no_code_with_model_and_inference():
    files = [p for p in BENCH.rglob("*.py") if p.name != "known_truth.py"]
    assert len(files) > 20
    for path in files:
        assert not foreign_imports(path.read_text(encoding="utf-8")), path
        assert "known_truth" not in path.read_text(encoding="utf-8"), path
    assert foreign_imports("from backdrive_bayes.engine.infer import infer")


def test_the_bench_loads_neither_model_nor_inference():
    code = "import sys, backdrive_bayes.bench.unit; print(*sorted(m for m in sys.modules if m.startswith('backdrive_bayes')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=BENCH.parents[1])
    assert "backdrive_bayes.bench.unit" in done.stdout
    assert not any(f"backdrive_bayes.{room}" in done.stdout for room in ("model", "inference", "indicators"))


def test_the_same_seed_gives_the_same_unit():
    one, two, other = unit({"stick_slip": 1}), unit({"stick_slip": 1}), unit({"stick_slip": 1}, seed=1)
    for a, b, c in zip(one.unit.records, two.unit.records, other.unit.records, strict=True):
        np.testing.assert_array_equal(a.angle_rad, b.angle_rad)
        assert not np.array_equal(a.angle_rad, c.angle_rad)


def test_threads_do_not_change_a_unit():
    """Last bits of the traces' strengths were those of sums in another order."""
    few, many = [], []
    for threads, found in ((1, few), (4, many)):
        with threadpool_limits(threads):
            found += [truth_json(unit({"sensor_lag": 1}, seed)) for seed in range(4)]
    assert few == many


def test_what_a_plan_does_not_show_is_not_there():
    """Another gain in each record, of one record; what is planted and seen is answered."""
    one, two = make_plan((1.0,), sampling_hz=200.0), make_plan((1.0, 5.0), sampling_hz=200.0)
    alone, both = (unit({"angle_scale": 1}, seed=1, plan=plan, bench="ode") for plan in (one, two))
    assert alone.truth.answer == () and alone.truth.planted[0].limited and both.truth.answer == ("unknown",)


def test_a_loop_that_does_not_reach_its_torque_has_no_lost_motion():
    small, full = (unit(plan=make_plan((1.0,), (a,), sampling_hz=400.0)).truth.records[0].indicators for a in (0.02, 0.2))
    assert np.isnan(small["lost_motion_rad"]) and full["lost_motion_rad"] > 0


@pytest.mark.parametrize("name", [*MECHANICS.effects, *MECHANICS.unlisted])
def test_severity_sets_the_height_above_noise(name):
    full, small = (unit({name: s}, soil=0.0).truth.planted[0] for s in (1.0, 0.1))
    assert full.limited or ruler.FULL[0] * 0.8 <= full.height <= ruler.FULL[1] * 1.2
    assert small.height < 0.15 * ruler.FULL[1] and small.effect.strength < full.effect.strength


def test_a_plain_unit_has_no_height():
    bench = unit({"none": 1})
    assert bench.truth.answer == () and not bench.truth.planted
    assert all(not t.effect_rad.any() for t in bench.truth.records)


def test_what_the_reducer_does_itself_is_absorbed():
    """The yardstick sees nothing in a change of the reducer, and something in the same change tied to one record."""
    reducer = MECHANICS.draw_reducer(np.random.default_rng(0), "intermediate")
    records = [Circumstances(_path(reducer, rate), 0.0, k) for k, rate in enumerate((0.5, 2.5))]
    measure = ruler.make_yardstick(MECHANICS, reducer, records, draw_noise(np.random.default_rng(0), reducer))

    def remainder(changed, only=None):
        z = (ruler.coarse_angle(MECHANICS, changed, (), records) - measure.plain_rad) / measure.noise_rad
        if only is not None:
            z[: z.size // 2] = 0
        return np.std(z), np.std(z - measure.basis @ (measure.basis.T @ z))

    changed = replace(reducer, compliance_share=1.05 * reducer.compliance_share)
    before, after = remainder(changed)
    assert after < 0.01 * before
    before, after = remainder(changed, only=1)
    assert after > 0.3 * before


def _path(reducer, rate):
    return make_path(Loop(1.0, rate), reducer.rated_torque_nm, ())


def test_effects_combine():
    both = unit({"sensor_lag": 1, "thermal_drift": 1})
    assert both.truth.answer == ("sensor_lag", "thermal_drift")
    assert len(both.truth.planted) == 2


def test_unknown_takes_an_effect_of_the_group_asked_for():
    for seed in range(4):
        for reserved in (False, True):
            truth = unit({"unknown": 1}, seed, reserved=reserved, plan=make_plan((5.0,), sampling_hz=200), soil=0.0).truth
            assert truth.answer == ("unknown",) and truth.planted[0].name in unlisted_names(MECHANICS, reserved)


@pytest.mark.parametrize(
    "effects", [{"slip": 1}, {"sensor_lag": -1}, {"sensor_lag": float("nan")}, {"none": 1, "sensor_lag": 1}, {"sensor_lag": "x"}]
)
def test_bad_effects_are_refused(effects):
    with pytest.raises(BadInput):
        unit(effects)


def test_noise_is_as_drawn():
    """Measured less true angle has the drawn variance; a record with a drift added to it does not pass."""

    def too_large(extra):
        bench = unit({"none": 1}, plan=make_plan((0.1,)), soil=0.0)
        noise, record, truth = bench.truth.noise, bench.unit.records[0], bench.truth.records[0]
        off = record.angle_rad - truth.angle_rad
        off = off + extra * noise.correlated_rad * np.linspace(-1, 1, off.size)
        ratio = np.var(off) / (noise.correlated_rad**2 + noise.white_rad**2)
        effective = off.size * (record.time_s[1] / noise.correlation_time_s)
        return abs(ratio - 1) > 5 * np.sqrt(2 / effective)

    assert not too_large(0.0)
    assert too_large(1.0)


def test_a_written_unit_is_read_back(tmp_path):
    bench = unit({"interface_slip": 1})
    write_unit(bench, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"unit.toml", *(r.name for r in bench.unit.records)}
    back = read_unit(tmp_path)
    assert back.rated_torque_nm == bench.unit.rated_torque_nm and back.reduction_ratio == bench.unit.reduction_ratio
    for ours, theirs in zip(bench.unit.records, back.records, strict=True):
        assert theirs.notes == ()
        np.testing.assert_allclose(theirs.angle_rad, ours.angle_rad, atol=1e-6 * np.ptp(ours.angle_rad))
        np.testing.assert_allclose(theirs.torque_nm, ours.torque_nm, atol=1e-6 * back.rated_torque_nm)
        np.testing.assert_allclose(theirs.time_s, ours.time_s, atol=1e-6)


def test_the_truth_is_complete_and_plain():
    truth = truth_json(unit({"viscoelastic_creep": 0.5}))
    assert truth["answer"] == ["viscoelastic_creep"] and truth["planted"][0]["severity"] == 0.5
    assert set(truth["records"][0]["indicators"]) >= {"loop_area_J", "absorbed_J", "peak_angle_rad", "lost_motion_rad"}
    assert all(0 < r["indicators"]["dissipation_ratio"] < 1 for r in truth["records"])


def test_the_held_record_has_minor_loops_at_another_rate():
    bench = unit({"viscoelastic_creep": 1, "sensor_lag": 1})
    held, clean = bench.truth.held, unit({"none": 1}).truth.held
    assert held.rate_nm_per_s not in {r.loading_rate_nm_per_s for r in bench.unit.records}
    assert np.abs(held.torque_nm).max() == pytest.approx(0.9 * bench.unit.rated_torque_nm)
    assert np.any(held.angle_rad != held.without_rad) and np.all(clean.angle_rad == clean.without_rad)


def test_clean_indicators_leave_out_what_is_planted():
    for name, same in (("none", True), ("sensor_lag", True), ("load_dependent_friction", False)):
        for truth in unit({name: 1}).truth.records:
            assert (truth.indicators == truth.clean_indicators) == same


def test_a_kind_is_drawn_and_told():
    short = make_plan((5.0,), sampling_hz=200)
    assert {unit({"none": 1}, seed, plan=short, soil=0.0).truth.kind for seed in range(12)} == set(MECHANICS.kinds)
    with pytest.raises(BadInput, match="geometric"):
        unit({"none": 1}, kind="round")


def test_random_plans_are_plans():
    rng = np.random.default_rng(0)
    plans = [random_plan(rng) for _ in range(40)]
    assert all(isinstance(p, Plan) and p.loops for p in plans)
    assert {len(p.loops) for p in plans} >= {1, 2, 3}


def test_pasts_are_none_one_side_both_or_loops_within_the_loop():
    pasts = [draw_past(np.random.default_rng(seed), 0.8) for seed in range(60)]
    assert {len(past) for past in pasts} == {0, 1, 2, 3, 4}
    assert all(np.all(np.abs(past) <= 0.8) and np.all(np.diff(np.sign(past)) != 0) for past in pasts)


def test_a_long_record_costs_little_more_than_a_short_one():
    """The mechanics run on events, not on samples: a hundred times the samples take less than eight times as long."""

    def seconds(hertz):
        start = time.perf_counter()
        unit({"none": 1}, plan=make_plan((0.1,), sampling_hz=hertz))
        return time.perf_counter() - start

    seconds(10.0)
    assert min(seconds(1000.0) for _ in range(3)) < 8 * min(seconds(10.0) for _ in range(3))
