"""The verb `blind`: files, figures, and one line for whatever is wrong."""

import json

import pytest

from backdrive_bayes.commands.main import main

LABELS = ["none", "sensor_lag", "unknown"]


def guess(folder, allowed):
    """A diagnoser of three labels that goes by the unit's number."""
    label = LABELS[int(folder.name[-1]) % 3]
    return {
        "gap": {"probability": 0.6},
        "which": [{"effect": n, "probability": 0.8 if n == label else 0.1} for n in LABELS],
        "answer": {"effects": [] if label == "none" else [label], "credible_set_90": LABELS[:2]},
    }


def keys_of(value):
    """Every key at any depth."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return {*(value if isinstance(value, dict) else ()), *(key for item in inner for key in keys_of(item))}


def test_a_check_writes_scores_and_figures(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("backdrive_bayes.blind.diagnosing.diagnose_folder", guess)
    out = tmp_path / "check"
    words = ["blind", "--units", "3", "--severities", "1", "--effects", "none,sensor_lag", "--plan", "quick", "--workers", "1"]
    assert main([*words, "--oracle", "1", "--removed", "1", "-o", str(out)]) == 0
    result = json.loads((out / "blind.json").read_text())
    assert result["schema"] == "backdrive-bayes/blind/1" and result["counts"]["units"] == 3
    assert sum(map(sum, result["confusion"]["counts"])) == 3 and len(result["units"]) == 3
    assert {p.stem for p in (out / "figures").iterdir()} == {"confusion", "power", "reliability", "sets"}
    text = capsys.readouterr().out
    kept = {p.name: json.loads(p.read_text()) for p in out.rglob("*.json")}
    assert [name for name, found in kept.items() if "seconds" in keys_of(found)] == ["run.json"]
    assert "3 units diagnosed, 0 without an answer" in text and "MISSED" in text
    assert main(["report", str(out)]) == 0 and (out / "report.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    "words",
    [
        ["--units", "0"],
        ["--units", "x"],
        ["--severities", "1,x"],
        ["--severities", "-1"],
        ["--effects", "slip"],
        ["--effects", "hardening_stiffness"],
        ["--effects", ""],
        ["--plan", "long"],
        ["--dirt", "nan"],
        ["--oracle", "99"],
        ["--removed", "-1"],
        ["--workers", "0"],
    ],
)
def test_wrong_options_give_one_line_and_write_nothing(words, tmp_path, capsys):
    out = tmp_path / "check"
    assert main(["blind", *words, "-o", str(out)]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1 and not out.exists()
