"""From result folders of fits to pool.json, figures and pages, and from there to a verdict."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from support.decided import write_evidence
from support.made_posterior import made_posterior

from backdrive_bayes import api
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.output import write_json
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.outcome import outcome_of
from backdrive_bayes.engine.parameters import implied_prior, posterior_parameters
from backdrive_bayes.errors import BadInput
from backdrive_bayes.pooling.pool import pool_batch
from backdrive_bayes.pooling.unit import prior_of, unit_draws

LOOP = ((0.05, 0.1),)
SIZES = (0.97, 1.03, 1.0, 0.94, 1.05, 1.01)
LIMITS = "[loop_area_J]\nmax = 1.0\n[risk]\nconsumer = 0.05\nproducer = 0.05\n"


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Fits of six reducers that differ in their size, 1 % known each."""
    room = tmp_path_factory.mktemp("batch")
    return [write_evidence(room / f"u{i}", f"u{i}", LOOP, seed=i, size=size) for i, size in enumerate(SIZES)]


@pytest.fixture(scope="module")
def units(folders):
    return [unit_draws(Evidence.read(folder)) for folder in folders]


@pytest.fixture(scope="module")
def brief(units):
    """The units with what they tell of three quantities only."""
    return [replace(unit, told=unit.told[:3]) for unit in units]


@pytest.fixture(scope="module")
def pool(units):
    found = pool_batch("spring", units, 3) | {"version": "0.1.0", "options": {}}
    return found | {"outcome": outcome_of(found).to_json()}


@pytest.fixture(scope="module")
def kept(pool, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pools") / "spring"
    folder.mkdir()
    write_json(folder / "pool.json", pool)
    return folder


def quantity(pool, name):
    return next(q for q in pool["quantities"] if q["name"] == name)


def test_the_batch_has_the_mean_and_spread_of_its_units(pool):
    """An angle's logarithm differs as the sizes do; the drawn mean of six lies within their standard error."""
    assert pool["units"] == [f"u{i}" for i in range(6)] and pool["left_out"] == []
    found, sizes = quantity(pool, "peak_angle_rad"), np.log(SIZES)
    assert found["scale"] == "log" and found["refused"] is None and found["loss_bits"] < 0.2
    assert found["spread"]["lo"] < sizes.std(ddof=1) < found["spread"]["hi"]
    own = np.mean([np.log(r["own"]["median"]) for r in found["of_units"]])
    assert np.log(found["mean"]["median"]) == pytest.approx(own, abs=0.01)
    assert {r["unit"] for r in found["of_units"]} == {f"u{i}" for i in range(6)}


def test_a_prior_is_the_class_at_the_units_knots():
    """The parameters of the drawn prior reducers are those that results state as implied by the class."""
    posterior = made_posterior(loops=LOOP)
    drawn, stated = posterior_parameters(prior_of(posterior, 4000)), implied_prior(posterior, 4000)
    for name in ("clearance_rad", "compliance_rated_rad_per_Nm"):
        own, known = (np.quantile(np.abs(p[name]), [0.25, 0.5, 0.75]) for p in (drawn, stated))
        assert own == pytest.approx(known, rel=0.15)


def test_units_that_cannot_be_compared_are_left_out_with_the_reason(brief):
    other = [replace(brief[0], name="odd", rated_torque_nm=0.2), replace(brief[1], name="bad", usable=False)]
    found = pool_batch("spring", [*brief, *other], 3)
    assert [(row["unit"], row["why"]) for row in found["left_out"]] == [
        ("odd", "another rated torque or k"), ("bad", "not converged, or forced"),
    ]  # fmt: skip
    read = [replace(unit, rated_torque_nm=unit.rated_torque_nm * (1 + 0.001 * k)) for k, unit in enumerate(brief)]
    assert not pool_batch("spring", read, 3)["left_out"], "of bare records the largest torque read stands for T_r"
    with pytest.raises(BadInput, match=r"at least 5 units that can be pooled, found 4 of 4"):
        pool_batch("spring", brief[:4])


def test_a_record_counts_once(brief):
    """Copies would narrow the batch's mean beyond what one measurement tells (planted fault: a hash of its own)."""
    copy = replace(brief[0], name="copy")
    found = pool_batch("spring", [*brief, copy], 3)
    assert found["left_out"] == [{"unit": "copy", "why": "a record of u0"}]
    other = replace(copy, data_hashes=("another",))
    assert "copy" in pool_batch("spring", [*brief, other], 3)["units"]


def test_same_units_and_seed_same_object(units, pool):
    again = pool_batch("spring", units, 3)
    assert again == {key: pool[key] for key in again}


def test_accept_takes_the_pool_for_its_global_risks(folders, kept, tmp_path, capsys):
    limits = tmp_path / "limits.toml"
    limits.write_text(LIMITS)
    arguments = ["accept", str(folders[0]), "--limits", str(limits), "-o", str(tmp_path / "out"), "--no-figures"]
    assert main([*arguments, "--batch", str(kept)]) == 0
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text())
    found = verdict["limits"][0]["global"]
    assert found["batch_units"] == 6 and found["process"]["shape"] == "pooled" and found["consumer"] < 1e-6
    assert verdict["options"]["batch"] == [f"u{i}" for i in range(6)]
    same = api.accept(folders[0], limits, batch=kept).result["limits"][0]["global"]
    assert same == found, "the Python interface takes the folder too"
    assert main([*arguments, "--batch", str(kept), str(folders[1])]) == 2
    assert "expected one pooled batch, or fits of other units, found 2 folders" in capsys.readouterr().err


def test_the_report_tells_the_batch(kept, pool):
    for library in ("typst", "matplotlib", "pypdf"):
        pytest.importorskip(library, reason="the report is made with the extra report and read with pypdf")
    import pypdf

    from backdrive_bayes.report.report import report_bytes

    pdf = report_bytes([kept])
    text = " ".join(" ".join(p.extract_text() for p in pypdf.PdfReader(io.BytesIO(pdf)).pages).split())
    assert "Batch spring" in text and pool["outcome"]["reason"] in text and "6 pooled, 0 left out" in text
    assert "Next unit" in text and "Loss [bit]" in text and "u5" in text
    assert pdf == report_bytes([kept])
