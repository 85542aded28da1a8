"""Evidence is asked by rate and amplitude, survives its files, and says why it cannot answer."""

import json
import shutil

import numpy as np
import pytest
from support.decided import CHAINS, DRAWS, KEPT, LOOPS, TYPICAL, diagnosis, evidence, write_evidence
from support.made_posterior import made_fit
from support.told import told
from support_results import write_result

from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.loops import Loop, NotAvailable, find_loop, largest_loops, measured_loops
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import CORE, UNITS

WITH_SMALL = (*LOOPS, (0.05, 0.04))


def test_loops_are_found_by_rate_and_amplitude():
    e = evidence(loops=WITH_SMALL)
    assert [(x.rate, x.amplitude) for x in e.measured] == [(0.01, 0.1), (0.05, 0.04), (0.05, 0.1), (0.1, 0.1)]
    assert e.loop(0.052).records == (1,) and e.loop(0.05, 0.0401).records == (3,)
    assert e.loop(0.05, 0.06) == Loop(0.05, 0.06, (1,), True)
    assert e.loop(0.01, 0.04).predicted and not e.loop(0.05, 0.04).predicted


@pytest.mark.parametrize(
    ("rate", "amplitude", "reason"),
    [(0.02, None, "rates cannot be predicted"), (0.05, 0.2, "beyond the measured"), (0.05, 0.001, "below 0.005")],
)
def test_what_is_not_there_is_refused_with_its_reason(rate, amplitude, reason):
    with pytest.raises(NotAvailable, match=reason):
        evidence().loop(rate, amplitude)


def test_repeats_are_one_loop_and_shrink_what_is_not_shared():
    e = evidence(loops=((0.05, 0.1),) * 4, spread=0.02)
    (loop,) = e.measured
    assert loop.records == (0, 1, 2, 3)
    assert np.std(e.values("peak_angle_rad", loop)) == pytest.approx(0.01 * TYPICAL["peak_angle_rad"], rel=0.1)


def test_plain_loops_need_no_draws():
    loops = measured_loops([0.05, 0.01, 0.0499], [0.1, 0.1, 0.05])
    assert [x.amplitude for x in largest_loops(loops)] == [0.1, 0.1]
    assert find_loop(loops, 0.05, 0.07).predicted


def test_values_have_the_draws_of_the_measured_or_the_kept():
    e = evidence()
    assert e.values("loop_area_J", e.loop(0.05)).shape == (CHAINS * DRAWS,)
    assert e.values("loop_area_J", e.loop(0.05), kept=True).shape == (KEPT,)
    assert e.values("loop_area_J", e.loop(0.05, 0.05)).shape == (KEPT,)


def test_undefined_is_refused():
    e = evidence(lost_motion_rad=np.nan)
    with pytest.raises(NotAvailable, match="not defined"):
        e.values("lost_motion_rad", e.loop(0.05))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_evidence(tmp_path_factory.mktemp("made") / "fit", loops=WITH_SMALL, seed=4)


def test_evidence_is_the_same_in_memory_and_from_its_files(folder):
    """Loops and prediction, hash and seed included: a verdict does not depend on the way it was come by."""
    memory, file = Evidence.of(*made_fit(loops=WITH_SMALL, seed=4)), Evidence.read(folder)
    assert memory.measured == file.measured and len(memory.measured) == 4 and file.converged
    for name in UNITS:
        loop = memory.loop(0.05)
        assert np.array_equal(memory.values(name, loop), file.values(name, loop)), name
    small = memory.loop(0.05, 0.07)
    assert small.predicted and np.array_equal(memory.values("tau1_Nm", small), file.values("tau1_Nm", small))
    assert np.array_equal(memory.parameters["clearance_rad"], file.parameters["clearance_rad"])
    told = memory.reproduction | {"folder": folder.name}
    assert told == file.reproduction and told["seed"] == 4 and file.rated_torque == 0.1
    table = file.about["records"][1]["indicators"]
    for name in CORE:
        assert np.median(memory.values(name, memory.loop(0.05, 0.1))) == pytest.approx(table[name]["median"], rel=1e-9)


def test_smaller_loops_are_those_of_the_weights(folder):
    e = Evidence.read(folder)
    measured, inside = e.loop(0.05, 0.04), Loop(0.05, 0.04, (1,), True)
    assert not measured.predicted
    assert np.median(e.values("loop_area_J", inside)) == pytest.approx(np.median(e.values("loop_area_J", measured)), rel=0.01)


def copied(folder, tmp_path):
    shutil.copytree(folder, tmp_path / "copy")
    return tmp_path / "copy"


def test_folders_that_are_none_are_one_clear_line(folder, tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        Evidence.read(tmp_path)
    folder = copied(folder, tmp_path)
    (folder / "diagnosis.json").write_text("{")
    with pytest.raises(BadInput, match="diagnosis.json: expected a JSON"):
        Evidence.read(folder)
    (folder / "diagnosis.json").unlink()
    (folder / "posterior.nc").unlink()
    with pytest.raises(BadInput, match="posterior.nc"):
        Evidence.read(folder)
    write_result(folder, records=1)
    with pytest.raises(BadInput, match="posterior.nc: expected"):
        Evidence.read(folder)


def diagnosed(folder, **changes):
    """Lay a diagnosis of the folder's data beside the fit, with some stamps changed."""
    about = json.loads((folder / "indicators.json").read_text())
    own = {key: about[key] for key in ("unit", "data_sha256", "unit_sha256", "version")}
    (folder / "diagnosis.json").write_text(json.dumps(told(diagnosis() | own) | changes))


def test_a_diagnosis_of_the_same_data_is_taken(folder, tmp_path):
    folder = copied(folder, tmp_path)
    diagnosed(folder)
    assert Evidence.read(folder).diagnosis["answer"] == {"effects": []}


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"unit": "other"}, "expected a result of unit u, as indicators.json has, found other"),
        ({"data_sha256": ["f" * 64]}, "expected data with SHA-256 0bfe935e70c3, .*found ffffffffffff"),
        ({"data_sha256": []}, "expected data with SHA-256 0bfe935e70c3, .*found none"),
        ({"unit_sha256": "e" * 64}, "expected a unit file with SHA-256 none, .*found eeeeeeeeeeee"),
        ({"version": "0.0.1"}, "expected a result of version .*found 0.0.1"),
    ],
)
def test_a_diagnosis_of_anything_else_is_refused(folder, tmp_path, changes, expected):
    folder = copied(folder, tmp_path)
    diagnosed(folder, **changes)
    with pytest.raises(BadInput, match=f"diagnosis.json: {expected}"):
        Evidence.read(folder)


def test_indicators_and_posterior_of_different_fits_are_refused(folder, tmp_path):
    """Of the same data even: an older indicators.json, or a posterior of another seed."""
    folder = copied(folder, tmp_path)
    other = write_evidence(tmp_path / "other", loops=WITH_SMALL, seed=5)
    shutil.copy(other / "posterior.nc", folder)
    with pytest.raises(BadInput, match="posterior.nc: expected the posterior with SHA-256"):
        Evidence.read(folder)
    about = json.loads((other / "indicators.json").read_text()) | {"data_sha256": ["f" * 64]}
    (folder / "indicators.json").write_text(json.dumps(about))
    with pytest.raises(BadInput, match="posterior.nc: expected data with SHA-256 ffffffffffff, as indicators.json has"):
        Evidence.read(folder)


def test_a_posterior_with_a_changed_hash_is_refused(folder, tmp_path):
    import h5py

    folder = copied(folder, tmp_path)
    with h5py.File(folder / "posterior.nc", "a") as file:
        for group in file.values():
            group.attrs["data_sha256"] = "f" * 64
    with pytest.raises(BadInput, match="posterior.nc: expected the file as it was written"):
        Evidence.read(folder)
