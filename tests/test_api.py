"""The five lines of the README, results that show themselves, and the example scripts."""

import copy
import json
import os
import runpy
import subprocess
import sys
import warnings
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.decided import evidence, write_evidence
from support.made_posterior import made_fit
from support.planted import planted, smooth_reducer

from conftest import ramps, write_csv  # isort: skip

import backdrive_bayes
import backdrive_bayes.api
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.errors import BadInput

ROOT = Path(__file__).resolve().parents[1]


def test_results_show_themselves_and_escape_what_others_wrote(tmp_path):
    verdict = backdrive_bayes.accept(evidence("<script>"), Limits((Limit("peak_angle_rad", hi=1.0),)))
    assert verdict.verdict == "accepted" and str(verdict).startswith("<script>: ACCEPTED: structure was not examined")
    shown = verdict._repr_html_()
    assert "&lt;script&gt;" in shown and "<script>" not in shown and "at most 1" in shown and "&gt; 0.999" in shown
    comparison = backdrive_bayes.compare(evidence("a"), evidence("<b>"), claims="paper")
    assert len(comparison.claims) == 33 and "&lt;b&gt;" in comparison._repr_html_()


def test_a_diagnosis_shows_its_answer_and_is_evidence_of_its_model(few_draws, tmp_path):
    unit = replace(planted(known=smooth_reducer(), offset_nm=8e-4), name="<offset>")
    found = backdrive_bayes.diagnose(unit)
    assert found.effects == ["torque_offset"] and found.probabilities["torque_offset"] > 0.5
    assert sum(found.probabilities.values()) == pytest.approx(1)
    assert "torque_offset" in found._repr_html_() and "&lt;offset&gt;" in found._repr_html_()
    verdict = backdrive_bayes.accept(found, Limits((Limit("peak_angle_rad", hi=1.0),)))
    assert verdict.result["structure"]
    saved = found.save(tmp_path / "out", figures=False)
    assert (saved / "diagnosis.json").is_file() and (saved / "posterior.nc").is_file()


def test_saved_fits_are_as_good_as_fresh_ones(tmp_path):
    folder = write_evidence(tmp_path / "fit", seed=3)
    limits = tmp_path / "limits.toml"
    limits.write_text("[loop_area_J]\nmax = 3.25e-4")
    saved, fresh = (backdrive_bayes.accept(e, limits).result for e in (folder, backdrive_bayes.api.Fit(*made_fit(seed=3))))
    assert saved["conformance_probability"] == fresh["conformance_probability"]
    assert saved["data_sha256"] == fresh["data_sha256"] and saved["seed"] == 3
    assert saved["version"] and saved["options"]["k"] == 0.03


def test_report_can_be_called_however_it_was_found(tmp_path):
    verdict = backdrive_bayes.accept(evidence(), Limits((Limit("peak_angle_rad", hi=1.0),)))
    assert backdrive_bayes.report(verdict, out=tmp_path).stat().st_size > 10_000
    dressed = backdrive_bayes.report(verdict, out=tmp_path / "dressed", template=ROOT / "examples" / "template")
    assert dressed.read_bytes() != (tmp_path / "report.pdf").read_bytes()
    import_module("backdrive_bayes.report.report")
    assert backdrive_bayes.report(verdict, out=tmp_path / "again").exists()


def test_a_unit_is_fitted_at_the_share_that_its_limits_name(monkeypatch):
    """The planted fault fits at 0.03 whatever they say, and then refuses them."""
    asked = []

    def made(**found):
        return lambda unit, **options: (asked.append(options), SimpleNamespace(**found))[1]

    monkeypatch.setattr(backdrive_bayes.api, "fit", made(evidence=evidence(k=0.04)))
    monkeypatch.setattr(backdrive_bayes.api, "diagnose", made(result=None))
    verdict = backdrive_bayes.api.accept("unit", Limits((Limit("lost_motion_rad", hi=1.0, k=0.04),)))
    assert verdict.verdict == "accepted" and asked == [{"k": 0.04}] * 2
    with pytest.raises(BadInput, match="one k for all limits"):
        backdrive_bayes.api.accept("unit", Limits(tuple(Limit("lost_motion_rad", hi=1.0, k=k) for k in (0.03, 0.04))))


def test_unknown_names_are_attribute_errors():
    assert {"fit", "accept", "compare", "report", "Unit"} <= set(dir(backdrive_bayes))
    with pytest.raises(AttributeError, match="nothing_of_ours"):
        _ = backdrive_bayes.nothing_of_ours


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Four small units of one short record each."""
    from conftest import answer

    folders = []
    for name, compliance in (("a", 0.01), ("b", 0.02), ("c", 0.021), ("d", 0.022)):
        folder = tmp_path_factory.mktemp(name)
        time, torque = ramps(noise=0.01)
        rng = np.random.default_rng(len(name))
        angle = answer(torque, compliance=compliance) * 10800 / np.pi + 0.1 * rng.normal(size=len(time))
        write_csv(folder / "a.csv", time, torque, angle)
        (folder / "unit.toml").write_text(
            f'schema = "backdrive-bayes/unit/1"\nname = "{name}"\nrated_torque_Nm = 1.0\n[[record]]\nfile = "a.csv"\n'
        )
        folders.append(folder)
    return folders


def run(script, *arguments):
    code = ["-W", "ignore", str(ROOT / "examples" / script), *map(str, arguments)]
    done = subprocess.run([sys.executable, *code], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def once():
    """In place of ``fit_unit``: what is fitted twice with the same options is computed once."""
    compute, known = backdrive_bayes.api.fit_unit, {}

    def fit_unit(unit, options, note):
        key = unit.data_sha256, options
        if key not in known:
            known[key] = compute(unit, options, note)
        return copy.deepcopy(known[key])

    return fit_unit


@pytest.fixture
def run_here(once, monkeypatch, capsys):
    """Like ``run``, in this process, so that the scripts share their fits."""

    def run_script(script, *arguments):
        path = ROOT / "examples" / script
        monkeypatch.setattr(backdrive_bayes.api, "fit_unit", once)
        monkeypatch.setattr(sys, "argv", [str(path), *map(str, arguments)])
        monkeypatch.syspath_prepend(path.parent)
        monkeypatch.chdir(ROOT)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            runpy.run_path(str(path), run_name="__main__")
        return capsys.readouterr().out

    return run_script


def test_example_five_lines(run_here, units, tmp_path, few_draws):
    limits = tmp_path / "limits.toml"
    limits.write_text("[peak_angle_rad]\nmax = 1")
    said = run_here("five_lines.py", units[0], "--limits", limits, "--out", tmp_path / "out")
    assert said.startswith("a: ") and (tmp_path / "out" / "report.pdf").exists()


def test_example_compare_units(run_here, units, tmp_path):
    said = run_here("compare_units.py", *units[:2], "--out", tmp_path / "out")
    assert "A turns less than B at every rate" in said and (tmp_path / "out" / "report.pdf").exists()


def test_example_acceptance_by_batch(run_here, units, tmp_path):
    limits = tmp_path / "limits.toml"
    limits.write_text("[peak_angle_rad]\nmax = 1")
    said = run_here("acceptance_by_batch.py", *units, "--limits", limits)
    assert "global risks: {" in said


def test_example_mujoco_joint(few_draws, run_here, units, tmp_path):
    pytest.importorskip("mujoco", reason="the extra bench is not installed")
    said = run_here("mujoco_joint.py", units[0], "--out", tmp_path / "out")
    assert "missing in the model: " in said and (tmp_path / "out" / "report.pdf").exists()
    found = json.loads((tmp_path / "out" / "1-diagnosis" / "diagnosis.json").read_text(encoding="utf-8"))
    assert found["simulator"]["unit"] == "mujoco-joint" and found["simulator"]["rms_rad"]["simulated"] > 0.01


def test_example_own_effect():
    assert "loose_plate: 0.00 to 1.00 mrad" in run("own_effect.py")


def test_an_effect_of_ones_own_is_registered_from_outside(tmp_path):
    """What an installed package with the entry point looks like: a .dist-info folder on the path."""
    info = tmp_path / "loose-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: loose\nVersion: 1\n")
    (info / "entry_points.txt").write_text("[backdrive_bayes.effects]\nloose_plate = loose_plate:LOOSE_PLATE\n")
    (tmp_path / "loose_plate.py").write_text((ROOT / "examples" / "own_effect.py").read_text(encoding="utf-8"), encoding="utf-8")
    code = "from backdrive_bayes.mechanics.registry import all_effects; print('loose_plate' in all_effects())"
    for path, known in ((str(tmp_path), "True"), ("", "False")):
        environment = os.environ | {"PYTHONPATH": path}
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, cwd=ROOT)
        assert done.stdout.strip() == known, done.stderr


def test_every_example_is_run_here():
    scripts = {p.name for p in (ROOT / "examples").glob("*.py") if not p.name.startswith("_")}
    text = Path(__file__).read_text(encoding="utf-8")
    assert scripts and all(f'"{name}"' in text for name in scripts)
