"""`fit --load`: B for the loads that were asked for, in indicators.json and on the screen."""

import json

import pytest

import backdrive_bayes
from backdrive_bayes.commands.main import main

BAD = {
    "zero load": ["--load", "0"],
    "infinite load": ["--load", "inf"],
    "absurd load": ["--load", "3.1"],
    "rate without a load": ["--load-rate", "1"],
    "negative rate": ["--load", "1", "--load-rate", "-1"],
}


@pytest.mark.parametrize("case", BAD)
def test_loads_that_cannot_be_answered_are_refused_at_once(case, unit_folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["fit", str(unit_folder), *BAD[case]]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "--load" in said and "expected" in said
    assert sorted(p.name for p in tmp_path.iterdir()) == ["unit"]


def test_loads_are_answered_in_the_file_and_on_the_screen(unit_folder, tmp_path, capsys, monkeypatch):
    out = tmp_path / "out"
    loads = ["--load", "0.5", "--load", "-1.5", "--load-rate", "0.25"]
    code = main(["fit", str(unit_folder), "-o", str(out), "--no-figures", *loads])
    rows = json.loads((out / "indicators.json").read_text())["loads"]
    assert [(r["load_Nm"], r["loading_rate_Nm_per_s"]) for r in rows] == [(0.5, 0.25), (-1.5, 0.25)]
    for row in rows:
        for name, sign in (("theta_L_rad", 1 if row["load_Nm"] > 0 else -1), ("W_L_J", 1)):
            assert sign * row[name]["median"] > 0 and row[name]["lo"] < row[name]["median"] < row[name]["hi"]
    assert [r["predicted"] for r in rows] == [["loading_rate"], ["load", "loading_rate"]]
    said = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert code == 0 and ["load", "rate", "[N·m/s]", "θ_L", "[′]", "W_L", "[mJ]", "not", "measured"] in said
    assert [line[-4:] for line in said if line[:1] == ["-1.5"]] == [["load", "and", "loading", "rate"]]


def test_without_loads_there_is_no_such_key_and_python_may_ask_later(unit_folder):
    fitted = backdrive_bayes.fit(unit_folder)
    assert "loads" not in fitted.indicators
    asked = backdrive_bayes.fit(unit_folder, loads=[0.5], load_rate=1.0).indicators["loads"]
    later = fitted.back_drive(0.5, rate=1.0)
    assert asked[0].keys() == later[0].keys()
    assert asked[0]["theta_L_rad"]["median"] == pytest.approx(later[0]["theta_L_rad"]["median"], rel=0.05)
    with pytest.raises(backdrive_bayes.BadInput, match="--load"):
        fitted.back_drive(0.0)
