"""Every bench by name: found, complete, and able to make a unit."""

import sys

import numpy as np
import pytest

from backdrive_bayes.bench.benches import BENCHES, find_bench
from backdrive_bayes.bench.plan import make_plan
from backdrive_bayes.bench.registry import EFFECTS
from backdrive_bayes.bench.unit import draw_unit
from backdrive_bayes.errors import BadInput

PLAN = make_plan((0.5, 2.0), sampling_hz=200.0)


def test_another_name_is_no_bench():
    with pytest.raises(BadInput, match="sliders, contact, ode, mujoco"):
        find_bench("cardboard")


def test_a_package_that_is_missing_is_told_in_one_line(tmp_path, monkeypatch):
    (tmp_path / "bench_without_engine").mkdir()
    (tmp_path / "bench_without_engine" / "__init__.py").write_text("import no_such_engine\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(BENCHES, "broken", "bench_without_engine")
    with pytest.raises(BadInput, match=r"no_such_engine.*backdrive-bayes\[bench\]") as error:
        find_bench("broken")
    assert "\n" not in str(error.value)


def test_no_engine_is_loaded_before_it_is_asked_for():
    assert "mujoco" not in sys.modules or "backdrive_bayes.bench.engine" in sys.modules


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_effect_is_of_the_reducer_on_every_bench_or_on_none(effect):
    """Slip was a fault of the channel on two benches, and part of the loop on two."""
    found = set()
    for name in BENCHES:
        mechanics, rng = find_bench(name), np.random.default_rng(2)
        found.add(mechanics.effects[effect](rng, mechanics.draw_reducer(rng, mechanics.kinds[0], ())).of_reducer)
    assert len(found) == 1


@pytest.mark.parametrize("name", BENCHES)
def test_a_bench_has_every_effect_and_makes_units(name):
    mechanics = find_bench(name)
    assert mechanics.name == name and len(mechanics.kinds) >= 3
    assert set(mechanics.effects) == set(EFFECTS) and len(mechanics.unlisted) >= 5
    assert not set(mechanics.unlisted) & set(EFFECTS)
    bench = draw_unit(np.random.default_rng(1), {"sensor_lag": 0.4}, bench=name, plan=PLAN)
    assert bench.truth.bench == name and bench.truth.answer == ("sensor_lag",)
    assert all(np.isfinite(r.angle_rad).all() for r in bench.unit.records)
    assert all(0 < t.clean_indicators["dissipation_ratio"] < 1 for t in bench.truth.records)
