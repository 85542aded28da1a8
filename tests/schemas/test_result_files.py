"""Every result file has a typed schema: what the verbs write fits it, and what lacks a key or holds another type is refused."""

import json

import pytest
from conftest import answer, ramps, write_csv
from support.decided import evidence, write_evidence
from support.made_up_diagnosis import write_diagnosis
from support.told import told
from support_results import write_result

from backdrive_bayes import results
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.output import write_json
from backdrive_bayes.decisions.claims import read_claims
from backdrive_bayes.decisions.comparison import compare
from backdrive_bayes.errors import BadInput
from backdrive_bayes.schemas.result_file import SHAPES, require_whole

FIT = {"indicators.json": results.INDICATORS, "diagnosis.json": results.DIAGNOSIS}


@pytest.fixture
def folder(tmp_path):
    write_result(tmp_path)
    write_diagnosis(tmp_path)
    return tmp_path


def test_every_schema_of_a_result_has_a_shape():
    named = {v for v in vars(results).values() if isinstance(v, str) and v.startswith("backdrive-bayes/")}
    assert set(SHAPES) >= named - {results.POSTERIOR}


@pytest.mark.parametrize("name", FIT)
def test_whole_files_are_read(folder, name):
    assert results.read_result(folder / name, FIT[name])["schema"] == FIT[name]


@pytest.mark.parametrize(
    ("name", "path", "value", "expected"),
    [
        ("indicators.json", ("k",), None, "key k: expected a probability, found no such key"),
        ("indicators.json", ("convergence", "converged"), "yes", "key convergence.converged: expected bool, found 'yes'"),
        ("indicators.json", ("records", 0, "indicators", "loop_area_J"), 3.0, "records 1, key indicators.loop_area_J"),
        ("indicators.json", ("records", 1, "torque_energy"), None, "records 2, key torque_energy: expected a table"),
        ("indicators.json", ("data_sha256", 0), "xyz", "a SHA-256 of 64 hexadecimal digits"),
        ("diagnosis.json", ("which", 0, "probability"), 1.5, "which 1, key probability: expected a probability, found 1.5"),
        ("diagnosis.json", ("where", "map", 0, "branch"), "up", "one of 'load+', 'load-', 'unload+', 'unload-'"),
        ("diagnosis.json", ("outcome",), None, "key outcome: expected a table, found no such key"),
    ],
)
def test_a_key_that_lacks_or_is_of_another_type_is_named(folder, name, path, value, expected):
    """``value`` None takes the key away."""
    result = json.loads((folder / name).read_text())
    place = result
    for step in path[:-1]:
        place = place[step]
    if value is None:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    (folder / name).write_text(json.dumps(result))
    with pytest.raises(BadInput) as refused:
        results.read_result(folder / name, FIT[name])
    assert expected in str(refused.value) and name in str(refused.value)


@pytest.mark.parametrize("text", ["9" * 5000, "[" * 200_000, "\udce4"], ids=["integer of 5000 digits", "deep", "no text"])
def test_hostile_json_is_one_line(text, tmp_path):
    (tmp_path / "r.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(BadInput, match="expected a JSON result file, found unreadable file"):
        results.read_result(tmp_path / "r.json", results.CHECK)


def test_keys_may_be_added(folder):
    result = json.loads((folder / "indicators.json").read_text()) | {"bench_log": {"temperature": 21}}
    require_whole(result, results.INDICATORS, "indicators.json")


def test_what_check_accept_compare_and_predict_write_fits(tmp_path):
    time, torque = ramps(noise=0.002)
    write_csv(tmp_path / "u.csv", time, torque, answer(torque) * 3437.7)
    (tmp_path / "limits.toml").write_text("[loop_area_J]\nmax = 1.0\n")
    (tmp_path / "history.csv").write_text("time_s,torque_Nm\n0,0\n1,0.05\n2,0\n")
    out = write_evidence(tmp_path / "fit")
    assert main(["check", str(tmp_path / "u.csv"), "-o", str(tmp_path / "check")]) == 0
    assert main(["accept", str(out), "--limits", str(tmp_path / "limits.toml"), "--no-figures"]) == 0
    assert main(["predict", str(out / "posterior.nc"), str(tmp_path / "history.csv"), "-o", str(tmp_path / "p")]) == 0
    write_json(tmp_path / "comparison.json", told(compare([evidence("a"), evidence("b")], read_claims("paper"))))
    found = {p.name: json.loads(p.read_text()) for p in tmp_path.rglob("*.json")}
    assert set(found) == {
        "check.json", "verdict.json", "indicators.json", "run.json", "prediction.json", "comparison.json",
    }  # fmt: skip
    for name, result in found.items():
        require_whole(result, result["schema"], name)
