"""The verb `simulate`: files, determinism, the truth kept apart, and one line for whatever is wrong."""

import json

import pytest

from backdrive_bayes.bench.benches import BENCHES
from backdrive_bayes.bench.registry import EFFECTS
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.simulate import SEVERITIES
from backdrive_bayes.records.unit_folder import read_unit

QUICK = ["--rates", "1,5", "--hertz", "200"]


def run(*words):
    return main(["simulate", *QUICK, *map(str, words)])


def test_a_unit_folder_is_written(tmp_path, capsys):
    assert run("--effect", "sensor_lag=0.5", "--effect", "thermal_drift", "--seed", "3", "-o", tmp_path / "unit") == 0
    unit = read_unit(tmp_path / "unit")
    assert len(unit.records) == 2 and unit.records[1].loading_rate_nm_per_s == pytest.approx(5 * unit.rated_torque_nm, rel=1e-4)
    assert "2 records" in capsys.readouterr().out


def test_the_same_seed_gives_the_same_bytes(tmp_path):
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        assert run("--effect", "unknown", "--seed", seed, "-o", tmp_path / name) == 0
    a, b, c = ([p.read_bytes() for p in sorted((tmp_path / n).glob("*.gz"))] for n in "abc")
    assert a == b and a != c


def test_the_truth_goes_only_where_asked(tmp_path):
    out, truth = tmp_path / "unit", tmp_path / "keys" / "truth.json"
    assert run("--effect", "encoder_error", "--seed", "2", "-o", out) == 0
    assert "encoder" not in (out / "unit.toml").read_text() and len(list(out.iterdir())) == 3
    assert run("--effect", "encoder_error", "--seed", "2", "-o", out, "--truth", truth) == 0
    assert json.loads(truth.read_text())["answer"] == ["encoder_error"]


def test_what_falls_short_of_its_severity_is_told(tmp_path, capsys):
    assert run("--effect", "encoder_error=10", "--seed", "1", "-o", tmp_path / "unit") == 0
    assert "encoder_error stands out by" in capsys.readouterr().out
    assert run("--effect", "sensor_lag=1", "--seed", "3", "-o", tmp_path / "unit") == 0
    assert "stands out" not in capsys.readouterr().out


def test_a_truth_that_cannot_be_written_is_refused_first(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert run("-o", tmp_path / "unit", "--truth", tmp_path / "file" / "truth.json") == 2
    assert not (tmp_path / "unit").exists() and len(capsys.readouterr().err.splitlines()) == 1


def test_another_bench_is_another_reducer(tmp_path):
    names = {}
    for bench in ("sliders", "ode"):
        truth = tmp_path / f"{bench}.json"
        assert run("--bench", bench, "--effect", "sensor_lag", "-o", tmp_path / bench, "--truth", truth) == 0
        names[bench] = json.loads(truth.read_text())
    assert names["ode"]["bench"] == "ode" and set(names["ode"]["reducer"]) != set(names["sliders"]["reducer"])
    assert len(names["ode"]["held"]["angle_rad"]) > 800


def test_help_lists_effects_severities_and_defaults_a_line_each(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["simulate", "--help"]) == 0
    text = capsys.readouterr().out
    shown = [" ".join(line.split()) for line in text.splitlines()]
    assert all(f"{name} {words}" in shown for name, words in (EFFECTS | SEVERITIES).items())
    assert all(name in text for name in BENCHES) and all(len(line) <= 88 for line in shown)
    defaults = ("default 1)", "default sliders)", "default 0.1,0.5,1)", "default 1000)", "a clean reducer (default)")
    assert all(words in " ".join(shown) for words in defaults)


@pytest.mark.parametrize(
    "words",
    [
        ["--effect", "slip"],
        ["--effect", "sensor_lag=-1"],
        ["--effect", "sensor_lag=x"],
        ["--effect", "sensor_lag="],
        ["--effect", "sensor_lag", "--effect", "sensor_lag=2"],
        ["--effect", "none", "--effect", "sensor_lag"],
        ["--rates", "0"],
        ["--rates", "1,,2"],
        ["--rates", "nan"],
        ["--rates", "0.0001", "--hertz", "10000"],
        ["--rates", "100", "--hertz", "10"],
        ["--amplitudes", "-1"],
        ["--cycles", "1.5"],
        ["--cycles", "0"],
        ["--kind", "round"],
        ["--bench", "cardboard"],
        ["--soil", "-1"],
        ["--seed", "-1"],
        ["--truth", "OUT/truth.json"],
    ],
    ids=" ".join,
)
def test_bad_input_is_one_line(tmp_path, capsys, words):
    words = [w.replace("OUT", str(tmp_path / "unit")) for w in words]
    assert run("-o", tmp_path / "unit", *words) == 2
    seen = capsys.readouterr()
    assert seen.err.count("\n") == 1 and not seen.out
    assert not list(tmp_path.iterdir())
