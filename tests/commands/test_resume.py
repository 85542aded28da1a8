"""`fit --resume`: exit code 4 and a chain, then 0 and none; one line where there is nothing to go on with."""

import json
from pathlib import Path

import pytest

from backdrive_bayes.commands.main import main
from backdrive_bayes.inference import diagnostics

RECORD = Path(__file__).resolve().parents[2] / "data" / "reducer-1" / "rate-0.05-amp-0.1.csv.gz"


def fit(out, *options):
    return main(["fit", str(RECORD), "-o", str(out), "--no-figures", *options])


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    out = tmp_path_factory.mktemp("fit") / "out"
    with pytest.MonkeyPatch.context() as patch:
        # One easy record would pass at the first look.
        patch.setattr(diagnostics, "MIN_ESS", 1e9)
        assert fit(out, "--budget", "0.01") == 4
    assert sorted(p.name for p in out.iterdir()) == ["chain.h5", "indicators.json", "posterior.nc"]
    advice = json.loads((out / "indicators.json").read_text())["convergence"]["advice"]
    assert "--resume" in advice
    return out


def test_another_seed_is_one_line_and_changes_nothing(stopped, capsys):
    before = (stopped / "chain.h5").read_bytes()
    assert fit(stopped, "--resume", "--seed", "7") == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert (stopped / "chain.h5").read_bytes() == before


def test_nothing_to_resume_is_one_line(tmp_path, capsys):
    assert fit(tmp_path / "none", "--resume") == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "chain.h5" in said
    assert not (tmp_path / "none").exists()


def test_resumed_fit_converges_and_leaves_no_chain(stopped):
    assert fit(stopped, "--resume", "--budget", "300") == 0
    assert sorted(p.name for p in stopped.iterdir()) == ["indicators.json", "posterior.nc"]
