"""Evidence is asked by rate and amplitude, survives its files, and says why it cannot answer."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import unit_of
from support.decided import CHAINS, DRAWS, KEPT, LOOPS, TYPICAL, evidence, write_evidence
from support_results import write_result

from backdrive_bayes.commands.results import FitOptions, fit_unit, keep_fit
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.loops import Loop, NotAvailable, find_loop, largest_loops, measured_loops
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import CORE, RESPONSES, UNITS

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
    with pytest.raises(NotAvailable, match="measured amplitudes only"):
        e.values("tau1_Nm", e.loop(0.05, 0.05))


def test_undefined_is_refused():
    e = evidence(lost_motion_rad=np.nan)
    with pytest.raises(NotAvailable, match="not defined"):
        e.values("lost_motion_rad", e.loop(0.05))


def test_a_result_folder_holds_the_same_evidence(tmp_path):
    e, again = evidence(seed=4), Evidence.read(write_evidence(tmp_path / "r", seed=4))
    assert again.name == e.name and again.measured == e.measured and again.converged
    assert np.array_equal(again.values("loop_area_J", e.loop(0.05)), e.values("loop_area_J", e.loop(0.05)))
    assert np.array_equal(again.parameters["clearance"], e.parameters["clearance"])
    assert again.reproduction["seed"] == 7 and again.rated_torque == 0.1


def test_a_real_fit_gives_the_same_evidence_in_memory_and_from_its_files(tmp_path):
    """Loops and prediction, hash and seed included: a verdict does not depend on the way it was come by."""
    unit = replace(unit_of(amplitudes=(0.1, 0.05)), data_hash="f" * 64)
    posterior, about = fit_unit(unit, FitOptions(seconds=0.5, seed=3))
    keep_fit(posterior, about, tmp_path, figures=False)
    memory, file = Evidence.of(posterior, about), Evidence.read(tmp_path)
    assert memory.measured == file.measured and len(memory.measured) == 2
    for name in UNITS:
        loop = memory.loop(0.05)
        assert np.array_equal(memory.values(name, loop), file.values(name, loop)), name
    small = memory.loop(0.05, 0.07)
    assert small.predicted and np.array_equal(memory.values("loop_area_J", small), file.values("loop_area_J", small))
    told = memory.reproduction | {"folder": tmp_path.name}
    assert told == file.reproduction and told["data_sha256"] == "f" * 64 and told["seed"] == 3
    table = about["records"][0]["indicators"]
    for name in CORE:
        assert np.median(memory.values(name, memory.loop(0.05))) == pytest.approx(table[name]["median"], rel=1e-5)
    peak, sensed = RESPONSES.index("theta_L_rad"), [str(n) for n in memory.draws["parameter"].values]
    assert (memory.draws["sensitivity"].values[:, peak, sensed.index("compliance")] > 0).all()


def test_folders_that_are_none_are_one_clear_line(tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        Evidence.read(tmp_path)
    folder = write_evidence(tmp_path / "r")
    (folder / "diagnosis.json").write_text("{")
    with pytest.raises(BadInput, match="diagnosis.json: expected a JSON"):
        Evidence.read(folder)
    (folder / "posterior.nc").unlink()
    with pytest.raises(BadInput, match="posterior.nc"):
        Evidence.read(folder)
    write_result(folder, records=1)
    (folder / "diagnosis.json").unlink()
    with pytest.raises(BadInput, match="fit the unit again"):
        Evidence.read(folder)
