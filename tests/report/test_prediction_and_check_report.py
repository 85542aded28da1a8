"""Predictions and checks have chapters of their own, with the numbers of their files."""

import json

import numpy as np
import pytest
from support.decided import write_evidence
from support.pdf import Pages
from support.planted import planted

from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.results import origin, stamped
from backdrive_bayes.errors import BadInput
from backdrive_bayes.figures.prediction import SHOWN, prediction_figures
from backdrive_bayes.number_text import ARCMIN_PER_RAD, with_error
from backdrive_bayes.records.check import check_unit
from backdrive_bayes.report import report
from backdrive_bayes.report.text import short_digest

pytestmark = pytest.mark.usefixtures("blank_pictures")


@pytest.fixture(scope="module")
def predicted(tmp_path_factory):
    """The folder of a prediction beside its fit, with a torque that was never measured."""
    folder = write_evidence(tmp_path_factory.mktemp("fit"))
    path = folder / "history.csv"
    torque = np.interp(np.linspace(0, 3, 151), range(4), [0, 0.11, -0.11, 0])
    np.savetxt(path, np.c_[np.linspace(0, 6, 151), torque], delimiter=",", header="time_s,torque_Nm", comments="")
    assert main(["predict", str(folder / "posterior.nc"), str(path), "-o", str(folder), "--extrapolate"]) == 0
    return folder


def text_of(folder):
    return Pages(report.report_bytes([folder])).text


def test_a_prediction_says_what_it_rests_on_and_its_caveat(predicted, tmp_path):
    result = json.loads((predicted / "prediction.json").read_text())
    alone = tmp_path / "alone"
    alone.mkdir()
    for name in ("prediction.json", "prediction.csv"):
        (alone / name).write_bytes((predicted / name).read_bytes())
    text = text_of(alone)
    curve = np.loadtxt(predicted / "prediction.csv", delimiter=",", skiprows=1)
    assert "history.csv" in text and f"{len(curve)} samples in 6 s, −0.11 to 0.11 N·m" in text
    assert result["caveat"] and result["caveat"].split(":")[0] in text and short_digest(result["posterior_sha256"]) in text
    assert f"half as wide as {0.5 * np.max(curve[:, 4] - curve[:, 3]):.3g} arcmin" in text


def test_a_prediction_beside_its_fit_is_a_chapter_and_one_of_another_fit_is_refused(predicted):
    assert "PREDICTED" in text_of(predicted) and "Key indicators" in text_of(predicted)
    path = predicted / "prediction.json"
    own = path.read_text()
    path.write_text(json.dumps(json.loads(own) | {"posterior_sha256": "f" * 64}))
    with pytest.raises(BadInput, match="the posterior with SHA-256"):
        report.report_bytes([predicted])
    path.write_text(own)


def test_a_curve_that_was_changed_is_refused(predicted):
    path = predicted / "prediction.csv"
    own = path.read_text()
    path.write_text(own.replace("0.11,", "0.12,", 1))
    with pytest.raises(BadInput, match="predict it again"):
        report.report_bytes([predicted])
    path.unlink()
    with pytest.raises(BadInput, match="No such file"):
        report.report_bytes([predicted])
    path.write_text(own)


def test_a_long_history_is_drawn_thinned_from_its_first_sample_on():
    time = 1.7e9 + 0.001 * np.arange(5 * SHOWN)
    (figure,) = prediction_figures(np.c_[time, np.sin(time), np.sin(time), np.sin(time) - 1, np.sin(time) + 1]).values()
    shown = figure.axes[1].lines[0].get_xdata()
    assert SHOWN <= shown.size <= 3 * SHOWN and shown[0] == 0.0 and shown[-1] == pytest.approx(time[-1] - time[0])


def test_a_brief_pulse_is_drawn_and_a_torque_that_rests_has_its_band():
    """Evenly taken samples alone (planted fault) pass a pulse by."""
    torque = np.zeros(10 * SHOWN)
    torque[20003:20005] = 0.5
    time, rest = np.arange(torque.size) / 100.0, np.zeros(torque.size)
    (figure,) = prediction_figures(np.c_[time, torque, torque, torque - 1, torque + 1]).values()
    assert figure.axes[0].lines[0].get_xdata().max() == 0.5
    (still,) = prediction_figures(np.c_[time, rest, rest, rest - 1, rest + 1]).values()
    assert all("90 % interval" in axes.get_legend_handles_labels()[1] for axes in still.axes)


def test_a_check_beside_a_fit_is_told_there(predicted):
    unit = planted()
    about = json.loads((predicted / "indicators.json").read_text())
    result = stamped(check_unit(unit), origin(unit), 0, {"k": 0.03}) | {key: about[key] for key in ("unit", "data_sha256")}
    (predicted / "check.json").write_text(json.dumps(result))
    assert "Noise and measured cycles" not in text_of(predicted)
    (predicted / "check.json").write_text(json.dumps(result | {"data_sha256": ["0" * 64]}))
    with pytest.raises(BadInput, match="data with SHA-256"):
        report.report_bytes([predicted])
    (predicted / "check.json").unlink()


def test_errors_are_told_before_notes(tmp_path):
    """However many these are."""
    unit = planted()
    result = stamped(check_unit(unit), origin(unit), 0, {"k": 0.03})
    notes = [{"level": "note", "code": "closure", "text": f"note {i}", "record": "a.csv"} for i in range(40)]
    result["findings"] = [*notes, {"level": "error", "code": "x", "text": "a wrong sign", "record": "b.csv"}]
    (tmp_path / "check.json").write_text(json.dumps(result))
    text = text_of(tmp_path)
    assert text.index("a wrong sign") < text.index("note 0") and "note 39" not in text


@pytest.mark.parametrize("scale", [1.0, -1.0], ids=["sound", "upside down"])
def test_a_check_says_what_was_found_and_whether_inference_may_go_on(scale, tmp_path):
    unit = planted()
    for record in unit.records:
        record.angle_rad[:] *= scale
    result = stamped(check_unit(unit), origin(unit), 0, {"k": 0.03})
    (tmp_path / "check.json").write_text(json.dumps(result))
    text = text_of(tmp_path)
    assert ("inference may go on" in text) == (scale > 0) and ("should not" in text) == (scale < 0)
    assert "−" * (scale < 0) in text
    for record in result["records"]:
        loop = record["measured_loop"]
        area = with_error(1e3 * loop["loop_area_J"], 1e3 * loop["loop_area_J_sd"])
        assert str(record["samples"]) in text and area in text
        assert f"{ARCMIN_PER_RAD * record['noise']['white_rad']:.2g}"[:4] in text
    assert all(f["text"].split()[0] in text for f in result["findings"])
