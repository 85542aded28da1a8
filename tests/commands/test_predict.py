"""`predict` says what it guessed and what its answer rests on, and leaves nothing of an older one."""

import json

import numpy as np
import pytest
from support.decided import write_evidence

from backdrive_bayes.commands.main import main


@pytest.fixture(scope="module")
def posterior(tmp_path_factory):
    return str(write_evidence(tmp_path_factory.mktemp("fit")) / "posterior.nc")


@pytest.fixture
def predicted(posterior, tmp_path, capsys):
    """Predict a ramp 0 → T → 0 of so many seconds; returns prediction.json and the screen."""

    def run(*options, largest=0.09, seconds=3.6, header="time_s,torque_Nm"):
        path = tmp_path / "history.csv"
        time = np.linspace(0, seconds, 101)
        torque = np.interp(time, [0, 0.5 * seconds, seconds], [0, largest, 0])
        np.savetxt(path, np.c_[time, torque], delimiter=",", header=header, comments="", encoding="utf-8")
        assert main(["predict", posterior, str(path), "-o", str(tmp_path / "p"), *options]) == 0
        return json.loads((tmp_path / "p" / "prediction.json").read_text()), capsys.readouterr().out

    return run


def test_guessed_columns_are_said_on_screen_and_in_the_file(predicted):
    result, screen = predicted(largest=90.0, header="t [s],Drehmoment [mNm]")
    said = "read 'Drehmoment [mNm]' as torque in mN·m"
    assert said in screen and said in result["notes"]
    assert predicted()[0]["notes"] == []


def test_stamps_of_a_clock_keep_their_digits(posterior, tmp_path):
    time = 1.7e9 + 0.01 * np.arange(400)
    table = np.c_[time, np.interp(np.arange(400), [0, 200, 399], [0, 0.09, 0])]
    np.savetxt(tmp_path / "h.csv", table, delimiter=",", header="time_s,torque_Nm", comments="", fmt="%.17g")
    assert main(["predict", posterior, str(tmp_path / "h.csv"), "-o", str(tmp_path / "p")]) == 0
    found = np.loadtxt(tmp_path / "p" / "prediction.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(found[:, 0], time, rtol=0, atol=1e-5)


def test_a_history_has_no_unit_file_to_say_its_columns_in(posterior, tmp_path, capsys):
    (tmp_path / "h.csv").write_text("a,b\n1,2\n3,4\n")
    assert main(["predict", posterior, str(tmp_path / "h.csv"), "-o", str(tmp_path / "p")]) == 2
    error = capsys.readouterr().err
    assert "a time column 'time_s'" in error and "unit.toml" not in error and "angle" not in error


def test_draws_of_an_older_prediction_go_and_a_stranger_s_file_stays(predicted, tmp_path):
    drawn = tmp_path / "p" / "draws.csv"
    drawn.parent.mkdir()
    drawn.write_text("mine")
    predicted()
    assert drawn.read_text() == "mine"
    predicted("--draws", "3")
    assert "angle_2_arcmin" in drawn.read_text()
    predicted()
    assert not drawn.exists()


def test_a_loading_rate_far_from_those_measured_is_a_caveat_and_no_failure(predicted):
    assert predicted()[0]["outcome"]["caveat"] == ""
    result, screen = predicted(seconds=0.018)
    caveat = result["outcome"]["caveat"]
    assert "10 N·m/s is far from those measured, 0.01 to 0.1 N·m/s" in caveat and caveat in screen
    assert result["outcome"]["exit_code"] == 0


def test_a_prediction_from_forced_data_says_so_everywhere(tmp_path, capsys):
    finding = {"level": "error", "text": "the encoder stands still", "record": "r.csv"}
    folder = write_evidence(tmp_path / "fit", findings=[finding], forced=True)
    np.savetxt(tmp_path / "h.csv", [[0, 0], [1, 0.05]], delimiter=",", header="time_s,torque_Nm", comments="")
    assert main(["predict", str(folder / "posterior.nc"), str(tmp_path / "h.csv"), "-o", str(tmp_path / "p")]) == 0
    result, screen = json.loads((tmp_path / "p" / "prediction.json").read_text()), capsys.readouterr().out
    assert result["forced"] and result["findings"] == [finding]
    assert "forced" in result["outcome"]["caveat"] and "forced" in screen and "the encoder stands still" in screen


def test_torque_beyond_the_measured_is_a_caveat(predicted):
    result, screen = predicted("--extrapolate", largest=0.11)
    assert "0.11 N·m are beyond the largest measured, 0.1 N·m" in result["outcome"]["caveat"]
    assert "extrapolated" in screen
