"""A whole blind check with invented diagnosers: sealed until the end, resumable, and nothing dropped."""

import hashlib
import json
import shutil

import pytest
from invented import look_around, never, stumble

from backdrive_bayes.blind.answers import understand
from backdrive_bayes.blind.diagnosing import diagnose_folder
from backdrive_bayes.blind.drawing import draw_and_write
from backdrive_bayes.blind.key import folder_digest
from backdrive_bayes.blind.request import Request
from backdrive_bayes.blind.seal import find_leaks
from backdrive_bayes.blind.study import Study, _calls, run_study
from backdrive_bayes.commands.output import write_json
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators import convergence

REQUEST = Request(4, severities=(1.0,), classes=("none", "sensor_lag", "torque_offset"), plan="quick", seed=3)


def study(out, diagnose, **more):
    return Study(REQUEST, out, diagnose, write_json, **more)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("check") / "out"
    return out, run_study(study(out, look_around, oracle=1))


def test_the_diagnosing_process_sees_the_hash_and_nothing_else_of_the_key(finished):
    out, _ = finished
    for path in sorted((out / "answers").rglob("*.json")):
        assert json.loads(path.read_text())["diagnosis"]["where"]["summary"] == "key.sha256"


def test_the_key_is_the_one_that_was_published(finished):
    out, result = finished
    sha256 = hashlib.sha256((out / "key" / "key.json").read_bytes()).hexdigest()
    assert (out / "key.sha256").read_text().split() == [sha256, "key/key.json"] and result["key_sha256"] == sha256
    assert (out / "key.sha256").stat().st_mtime_ns <= min(p.stat().st_mtime_ns for p in (out / "answers").rglob("*.json"))
    assert result["counts"] == {"units": 4, "answered": 4, "failed": 0}
    assert len(list((out / "answers" / "oracle").iterdir())) == 1


def test_a_finished_check_is_scored_again_without_drawing_or_diagnosing(finished):
    out, result = finished
    before = {p: p.stat().st_mtime_ns for p in out.rglob("*")}
    assert run_study(study(out, never, oracle=1)) == result
    assert before == {p: p.stat().st_mtime_ns for p in out.rglob("*")}


def test_once_the_key_is_open_no_answer_is_added(finished):
    out, _ = finished
    with pytest.raises(BadInput, match="the key has been opened"):
        run_study(study(out, never, oracle=2))
    with pytest.raises(BadInput, match="take a new OUT"):
        run_study(Study(Request(4, plan="quick"), out, never, write_json))


def test_a_refused_check_leaves_another_one_as_it_is(finished, tmp_path):
    """Its units were drawn over those of the first."""
    out, _ = finished
    shutil.copytree(out, tmp_path / "out", ignore=shutil.ignore_patterns("key", "answers"))
    before = {p.name: folder_digest(p) for p in sorted((tmp_path / "out" / "units").iterdir())}
    with pytest.raises(BadInput, match="take a new OUT"):
        run_study(Study(Request(5, plan="quick", seed=9), tmp_path / "out", never, write_json))
    assert {p.name: folder_digest(p) for p in sorted((tmp_path / "out" / "units").iterdir())} == before
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["key.sha256", "units"]
    shutil.copytree(out / "units" / "unit-0001", tmp_path / "out" / "units" / "unit-0009")
    with pytest.raises(BadInput, match="unit-0009 beside them"):
        run_study(study(tmp_path / "out", never))


def test_units_that_were_changed_are_not_scored(finished, tmp_path):
    """Also after the key was opened."""
    out, result = finished
    shutil.copytree(out, tmp_path / "out")
    assert run_study(study(tmp_path / "out", never, oracle=1)) == result
    shutil.rmtree(tmp_path / "out" / "units" / "unit-0001")
    assert run_study(study(tmp_path / "out", never, oracle=1)) == result, "an opened check needs its units no more"
    path = next((tmp_path / "out" / "units" / "unit-0002").glob("*.csv.gz"))
    path.write_bytes(path.read_bytes()[:-9])
    with pytest.raises(BadInput, match="the files that were drawn"):
        run_study(study(tmp_path / "out", never, oracle=1))


def test_what_the_class_holds_is_not_removed(tmp_path):
    """A second clearance without its name is no gap: the answer is none, not unknown."""
    named = ("interface_slip", "second_backlash", "sensor_lag", "torque_offset")
    units = [{"unit": f"unit-{i}", "effects": [name]} for i, name in enumerate(named)]
    found = _calls(study(tmp_path, never, removed=9, oracle=9), "removed", units)
    assert list(found) == ["unit-2", "unit-3"] and "sensor_lag" not in found["unit-2"][1]
    assert len(_calls(study(tmp_path, never, oracle=9), "oracle", units)) == 4


def test_a_changed_key_is_noticed(finished, tmp_path):
    out, _ = finished
    (tmp_path / "key").mkdir()
    (tmp_path / "key.sha256").write_text((out / "key.sha256").read_text())
    (tmp_path / "key" / "key.json").write_text((out / "key" / "key.json").read_text().replace("sensor_lag", "stick_slip"))
    with pytest.raises(BadInput, match="SHA-256"):
        run_study(study(tmp_path, never))


def test_leaks_are_noticed(finished, tmp_path):
    unit = tmp_path / "units" / "unit-0001"
    unit.mkdir(parents=True)
    (unit / "unit.toml").write_text('name = "unit-0001"\n')
    (unit / "01-rate-1-amp-1.csv.gz").write_bytes(b"")
    assert find_leaks(tmp_path) == []
    (unit / "unit.toml").write_text('name = "unit-0001"\ndescription = "Sensor_Lag at 0.4"\n')
    (unit / "truth.json").write_text("{}")
    (tmp_path / "key.json").write_text("{}")
    (tmp_path / "answers" / "blind").mkdir(parents=True)
    (tmp_path / "answers" / "blind" / "unit-0001.json").write_text("{}")
    leaks = find_leaks(tmp_path)
    assert len(leaks) == 3 and any("Sensor_Lag" in leak for leak in leaks)


def test_a_check_that_would_leak_is_not_run(tmp_path):
    (tmp_path / "notes.txt").write_text("unit-0001 has a lag")
    with pytest.raises(BadInput, match=r"notes\.txt"):
        run_study(study(tmp_path, never))
    assert not (tmp_path / "answers").exists()


def test_answers_before_a_hash_are_refused(tmp_path):
    (tmp_path / "answers" / "blind").mkdir(parents=True)
    (tmp_path / "answers" / "blind" / "unit-0001.json").write_text("{}")
    with pytest.raises(BadInput, match="answers without one"):
        run_study(study(tmp_path, never))


def test_what_raises_or_dies_is_counted_and_an_interrupted_check_goes_on(tmp_path):
    class Interrupted(Exception):
        pass

    def stop(text, share):
        if "diagnosed 1 of" in text:
            assert 0 < share < 1
            raise Interrupted

    with pytest.raises(Interrupted):
        run_study(study(tmp_path, look_around, note=stop))
    assert not (tmp_path / "key").exists()
    kept = {p.name: p.read_bytes() for p in (tmp_path / "answers" / "blind").iterdir()}
    assert list(kept) == ["unit-0001.json"]
    result = run_study(study(tmp_path, stumble, removed=2))
    assert (tmp_path / "answers" / "blind" / "unit-0001.json").read_bytes() == kept["unit-0001.json"]
    errors = {failure["unit"]: failure["error"] for failure in result["failures"]}
    assert errors == {"unit-0002": "ValueError: two lines", "unit-0003": "the process died"}
    assert result["counts"] == {"units": 4, "answered": 2, "failed": 2}
    assert result["removed"]["unknown"]["of"] == 2


def test_what_the_measurement_contradicts_is_no_answer(tmp_path, monkeypatch):
    """As the verb says it: the blind check took the sampling's word alone."""
    drawn = draw_and_write(Request(1, plan="quick", seed=4), 0, {}, tmp_path)
    monkeypatch.setattr(convergence, "contradictions", lambda draws, measured: ["S was measured as 2 J"])
    found = diagnose_folder(tmp_path / drawn["unit"], None)
    answer = understand(found)
    assert found["convergence"]["contradictions"] and answer.label is None and answer.error.startswith("inconclusive")
