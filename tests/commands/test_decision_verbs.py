"""`accept` and `compare` on former fits: exit codes, files, and one clear line for what a user gets wrong."""

import json
import re

import numpy as np
import pytest
from support.decided import diagnosis, write_evidence
from support.made_posterior import made_fit

from backdrive_bayes import api
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.results import HIGHEST_LEVEL, FitOptions, require_fitted_with
from backdrive_bayes.decisions.comparison import require_own_records
from backdrive_bayes.engine import sample
from backdrive_bayes.errors import BadInput

AREA = made_fit("a")[1]["records"][1]["indicators"]["loop_area_J"]["median"]


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    room = tmp_path_factory.mktemp("fits")
    write_evidence(room / "a", name="a")
    write_evidence(room / "b", name="b", seed=1, size=2.0)
    write_evidence(room / "c", name="c", converged=False)
    write_evidence(room / "gap", name="a", diagnosis=diagnosis(["unknown"], unknown=0.9, none=0.1))
    write_evidence(room / "other-model", name="a", effects=["sensor_lag"], size=3.0)
    return room


def limits(tmp_path, text):
    path = tmp_path / "limits.toml"
    path.write_text(text)
    return str(path)


def area(tmp_path, factor):
    return limits(tmp_path, f"[loop_area_J]\nmax = {AREA * factor}\nat = {{loading_rate_Nm_per_s = 0.05}}\n")


@pytest.mark.parametrize(("factor", "code", "verdict"), [(1.1, 0, "accepted"), (0.9, 3, "rejected"), (1.005, 4, "inconclusive")])
def test_accept_by_its_exit_code(fits, tmp_path, capsys, factor, code, verdict):
    out = tmp_path / "out"
    assert main(["accept", str(fits / "a"), "--limits", area(tmp_path, factor), "-o", str(out)]) == code
    found = json.loads((out / "verdict.json").read_text())
    assert found["verdict"] == verdict and found["schema"] == "backdrive-bayes/verdict/1"
    assert found["limits"][0]["min"] is None, "an open side is null"
    assert (out / "figures" / "acceptance.svg").exists()
    said = capsys.readouterr().out
    assert verdict.upper() in said and ("next:" in said) == (verdict == "inconclusive")


def test_structure_speaks_through_the_exit_code(fits, tmp_path):
    good = area(tmp_path, 1.1)
    assert main(["accept", str(fits / "c"), "--limits", good, "-o", str(tmp_path / "1"), "--no-figures"]) == 4
    assert main(["accept", str(fits / "gap"), "--limits", good, "-o", str(tmp_path / "2"), "--no-figures"]) == 4
    model = f"{fits / 'other-model'}=0.4"
    assert main(["accept", str(fits / "a"), "--limits", good, "--model", model, "-o", str(tmp_path / "3"), "--no-figures"]) == 4
    found = json.loads((tmp_path / "3" / "verdict.json").read_text())
    assert [m["probability"] for m in found["structure"]["models"]] == [pytest.approx(0.6), pytest.approx(0.4)]


def test_a_verdict_belongs_to_its_posterior(tmp_path, capsys):
    """The verdict of one fit does not come to lie beside another of the same data."""
    one, other = (write_evidence(tmp_path / name, name="a", seed=seed) for name, seed in (("one", 0), ("other", 1)))
    good = area(tmp_path, 1.1)
    assert main(["accept", str(one), "--limits", good, "-o", str(other), "--no-figures"]) == 2
    assert "the posterior with SHA-256" in capsys.readouterr().err and not (other / "verdict.json").exists()
    assert main(["accept", str(one), "--limits", good, "--no-figures"]) == 0
    verdict, fit = (json.loads((one / f"{name}.json").read_text()) for name in ("verdict", "indicators"))
    assert verdict["posterior_sha256"] == fit["posterior_sha256"]


def test_a_former_fit_keeps_its_verdict_beside_it(tmp_path):
    folder = write_evidence(tmp_path / "fit")
    before = (folder / "posterior.nc").read_bytes()
    assert main(["accept", str(folder), "--limits", area(tmp_path, 1.1), "--no-figures"]) == 0
    assert (folder / "verdict.json").exists() and (folder / "posterior.nc").read_bytes() == before


def test_the_same_call_gives_the_same_bytes(fits, tmp_path):
    for name in ("1", "2"):
        main(["accept", str(fits / "a"), "--limits", area(tmp_path, 1.005), "-o", str(tmp_path / name), "--no-figures"])
        main(["compare", str(fits / "a"), str(fits / "b"), "--claims", "paper", "-o", str(tmp_path / name), "--no-figures"])
    for file in ("verdict.json", "comparison.json"):
        assert (tmp_path / "1" / file).read_bytes() == (tmp_path / "2" / file).read_bytes()


def test_compare_with_claims(fits, tmp_path, capsys):
    own = tmp_path / "claims.toml"
    claim = 'text = "A loses less"\nholds = "A.loop_area_J < B.loop_area_J"\nevery = "rate"'
    own.write_text(f'schema = "backdrive-bayes/claims/1"\n[[claim]]\n{claim}')
    out = tmp_path / "out"
    assert main(["compare", str(fits / "a"), str(fits / "b"), "--claims", str(own), "-o", str(out)]) == 0
    found = json.loads((out / "comparison.json").read_text())
    assert found["claims"]["claims"][0]["verdict"] == "holds" and found["names"] == ["a", "b"]
    assert found["pairs"][0]["conditions"][1]["indicators"]["loop_area_J"]["verdict"] == "less"
    assert (out / "figures" / "comparison-ratios.svg").exists()
    assert re.search(r"1 +A loses less +0\.\d+ +holds", capsys.readouterr().out)
    assert main(["compare", str(fits / "a"), str(fits / "c"), "-o", str(tmp_path / "2"), "--no-figures"]) == 4


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["accept", "{a}"], "--limits"),
        (["accept", "{a}", "--limits", "{none}"], "nothing there"),
        (["accept", "{none}", "--limits", "{good}"], "nothing there"),
        (["accept", "{a}", "--limits", "{unknown}"], "did you mean loop_area_J"),
        (["accept", "{a}", "--limits", "{rate}"], "was not measured"),
        (["accept", "{a}", "--limits", "{good}", "--model", "{b}"], "OUT=PROBABILITY"),
        (["accept", "{a}", "--limits", "{good}", "--model", "{b}=0.5"], "of one unit"),
        (["accept", "{a}", "--limits", "{good}", "--model", "{a}=1.5"], "leave some for UNIT"),
        (["accept", "{a}", "--limits", "{good}", "--batch", "{b}"], "at least 3 other units"),
        (["accept", "{a}", "--limits", "{good}", "--level", "2"], "--level"),
        (["accept", "{a}", "--limits", "{good}", "--level", "0.999999"], "at most 0.99, beyond which too few draws lie"),
        (["accept", "{a}", "--limits", "{good}", "--k", "0.1"], "--k: expected 0.03, with which 'a' was fitted, found 0.1"),
        (["accept", "{a}", "--limits", "{good}", "--baseline", "elastic"], "--baseline: expected geometric,elastic,friction"),
        (["compare", "{a}", "{b}", "--k", "0.1"], "--k: expected 0.03, with which 'a' was fitted"),
        (["compare", "{a}"], "two units or more"),
        (["compare", "{a}", "{none}"], "nothing there"),
        (["compare", "{a}", "{a}"], "units of different records, found the same records in"),
        (["compare", "{b}", "{a}", "{gap}"], "units of different records, found the same records in"),
        (["compare", "{a}", "{b}", "--rope", "0"], "--rope"),
        (["compare", "{a}", "{b}", "--claims", "{none}"], "a claims file or 'paper'"),
    ],
)
def test_every_mistake_is_one_line_and_leaves_nothing(fits, tmp_path, capsys, arguments, expected):
    (tmp_path / "made").mkdir()
    texts = {
        "good": "[loop_area_J]\nmax = 1",
        "unknown": "[loop_area]\nmax = 1",
        "rate": "[loop_area_J]\nmax = 1\nat = {loading_rate_Nm_per_s = 0.7}",
    }
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    folders = {n: fits / n for n in ("a", "b", "gap")}
    names = {n: tmp_path / f"{n}.toml" for n in texts} | folders | {"none": tmp_path / "none.toml"}
    out = tmp_path / "made" / "out"
    assert main([*(a.format(**names) for a in arguments), "-o", str(out)]) == 2
    error = capsys.readouterr().err
    assert expected in error and error.count("\n") == 1 and "Traceback" not in error
    assert not list((tmp_path / "made").iterdir())


def test_a_baseline_is_the_one_that_was_asked_for():
    """Also where the fit holds the module again that was withheld, as a diagnosis does."""
    about = {"unit": "u", "k": 0.03, "level": 0.9, "seed": 0, "options": {"baseline": ["geometric", "elastic"]}}
    require_fitted_with(FitOptions(("elastic", "geometric")), about)
    with pytest.raises(BadInput, match="--baseline: expected geometric,elastic, with which 'u' was fitted, found elastic"):
        require_fitted_with(FitOptions(("elastic",)), about)


def test_a_comparison_records_its_own_level(fits, tmp_path):
    assert main(["compare", str(fits / "a"), str(fits / "b"), "--level", "0.5", "-o", str(tmp_path), "--no-figures"]) == 0
    found = json.loads((tmp_path / "comparison.json").read_text())
    assert found["level"] == found["options"]["level"] == 0.5


def test_units_that_share_a_record_are_not_compared():
    """Not only those of the same records all: their draws are not independent."""
    units = (("a", ("1", "2")), ("b", ("3",)), ("c", ("2", "4")))
    require_own_records(units[:2])
    with pytest.raises(BadInput, match="the same records in 'a' and 'c'"):
        require_own_records(units)


def test_the_python_interface_refuses_what_the_verb_does(fits):
    for wrong, said in (((fits / "a", fits / "a"), "the same records"), ((fits / "a", fits / "b"), "rope")):
        with pytest.raises(BadInput, match=said):
            api.compare(*wrong, rope=0.05 if said != "rope" else 2.0)
    for seed in ("1", -1, 1.5, None, 10**30, True):
        with pytest.raises(BadInput, match="--seed"):
            FitOptions(seed=seed)
    assert FitOptions(seed=np.int64(3)).seed == 3
    for results in ((), (fits / "a", 3)):
        with pytest.raises(BadInput, match="results or folders"):
            api.report(*results, out=fits / "none")
    assert not (fits / "none").exists()


def test_modules_are_given_as_a_list_or_as_the_verb_takes_them_and_shares_are_numbers():
    assert FitOptions("elastic,friction").baseline == FitOptions(["elastic", "friction"]).baseline == ("elastic", "friction")
    for wrong in ({"k": "x"}, {"level": None}, {"k": True}, {"baseline": "foo"}):
        with pytest.raises(BadInput, match="expected"):
            FitOptions(**wrong)


def test_nothing_is_decided_on_forced_data(tmp_path, capsys):
    """Whatever its intervals say; without force the same fit is accepted (planted fault: it was with force, too)."""
    for forced in (False, True):
        folder = write_evidence(tmp_path / str(forced), name="f", forced=forced)
        path = limits(tmp_path, f"[loop_area_J]\nmax = {2 * AREA}\n[risk]\nconsumer = 0.05\nproducer = 0.1\n")
        assert main(["accept", str(folder), "--limits", path, "--no-figures", "-o", str(tmp_path / "v")]) == (4 if forced else 0)
        result = json.loads((tmp_path / "v" / "verdict.json").read_text())
        assert all(row["verdict"] == ("inconclusive" if forced else "accepted") for row in result["limits"])
        assert not forced or "without --force" in result["next"]["do"]


def test_the_draws_of_a_fit_resolve_the_highest_level():
    assert round(sample.ENSEMBLES * sample.KEPT * (1 - HIGHEST_LEVEL) / 2, 6) >= 8
    assert FitOptions(level=HIGHEST_LEVEL).level == HIGHEST_LEVEL


def test_a_limit_that_no_record_tells_of_is_said_before_sampling(unit_folder, tmp_path, capsys):
    wrong = limits(tmp_path, "[loop_area_J]\nmax = 1\nat = {loading_rate_Nm_per_s = 0.01}")
    assert main(["accept", str(unit_folder), "--limits", wrong, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "was not measured" in error and "warming up" not in error
