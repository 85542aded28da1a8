"""The whole diagnosis: one seed, one answer; the chosen posterior is the one that was computed."""

import json

import numpy as np
import pytest
from support.planted import planted, smooth_reducer

from backdrive_bayes.engine import sample
from backdrive_bayes.gap.diagnose import diagnose
from backdrive_bayes.results import DIAGNOSIS


@pytest.fixture(scope="module")
def twice():
    """A unit with a torque offset, diagnosed twice with few draws."""
    unit = planted(known=smooth_reducer(), offset_nm=8e-4)
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("FIRST_STEPS", 3), ("MOST_STEPS", 3)):
            patch.setattr(sample, name, value)
        yield diagnose(unit, seed=2), diagnose(unit, seed=2)


def test_one_seed_gives_one_answer(twice):
    first, again = (json.dumps(d.json, sort_keys=True) for d in twice)
    assert first == again and twice[0].effects == twice[1].effects


def test_the_answer_is_the_planted_effect(twice):
    found = twice[0].json
    assert found["schema"] == DIAGNOSIS and found["answer"]["effects"] == ["torque_offset"]
    assert sum(row["probability"] for row in found["which"]) == pytest.approx(1.0)
    assert found["gap"]["probability"] > 0.9 and 0 <= found["gap"]["unlisted_probability"] < 0.3
    assert "torque_offset" in found["answer"]["credible_set_90"]
    row = next(r for r in found["which"] if r["effect"] == "torque_offset")
    offset = row["parameters"]["offset"]
    assert offset["unit"] == "N·m" and offset["lo"] < offset["median"] < offset["hi"]
    assert offset["median"] == pytest.approx(8e-4, rel=0.1)


def test_the_posterior_is_that_of_the_answer(twice):
    chosen = twice[0].posterior
    assert twice[0].effects == ("torque_offset",) and tuple(chosen.hypothesis) == ("torque_offset",)
    values = chosen.flat["torque_offset"][:, 0] * chosen.context.torque_scale_nm
    row = next(r for r in twice[0].json["which"] if r["effect"] == "torque_offset")
    assert np.median(values) == pytest.approx(row["parameters"]["offset"]["median"], rel=1e-9)


def test_few_steps_are_said_not_to_have_converged(twice):
    assert twice[0].json["convergence"]["converged"] is False


def test_residuals_are_of_what_is_fitted_about_their_mean(twice):
    """With the first loading, which is not fitted, all others lay beside zero."""
    posterior = twice[0].posterior
    for row, blocks in zip(twice[0].json["residual"], posterior.records.blocks, strict=True):
        assert len(row["torque_Nm"]) == len(row["before_rad"]) == np.count_nonzero(blocks.leg > 0) < blocks.count.size
        for key in ("before_rad", "after_rad"):
            assert abs(np.mean(row[key])) < 1e-9


def test_what_a_baseline_lacks_is_a_gap_that_is_seen():
    """Gap, place and the model before were those of the whole class: nothing stood out from the noise."""
    unit = planted(known=smooth_reducer())
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("FIRST_STEPS", 3), ("MOST_STEPS", 3)):
            patch.setattr(sample, name, value)
        found = diagnose(unit, seed=2, baseline=("elastic",)).json
    assert set(found["answer"]["effects"]) == {"geometric", "friction"}
    assert found["gap"]["rms_rad"] > 5.0 * found["gap"]["noise_floor_rad"]
    change = found["shrink"]["indicators"]["lost_motion_rad"]
    assert change["before"]["median"] > 2.0 * change["after"]["median"]


def test_everything_is_plain_numbers(twice):
    text = json.dumps(twice[0].json, allow_nan=False)
    assert len(text) > 5000
    assert {"where", "shrink", "next_test", "parameter_shift", "residual", "records"} <= set(twice[0].json)
