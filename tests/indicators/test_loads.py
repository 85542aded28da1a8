"""B = (θ_L, W_L) for chosen loads and rates: at hand by measurement, between measured rates, and beyond what was measured."""

import numpy as np
import pytest
from support.made_posterior import made_posterior

from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.loads import loads_json
from backdrive_bayes.indicators.loop import loop_grid, settled_loops

SLOW, FAST, RATED = 0.02, 0.2, 0.1


@pytest.fixture(scope="module")
def posterior():
    """A unit measured at two rates, and at the slow one with a smaller loop too."""
    return made_posterior(loops=((SLOW, 0.5 * RATED), (SLOW, RATED), (FAST, RATED)), spread=0.003)


def width(entry):
    return (entry["hi"] - entry["lo"]) / abs(entry["median"])


@pytest.mark.parametrize("load", [0.06, -0.06, RATED])
def test_b_is_that_of_the_settled_loop(posterior, load):
    angle, energy = ind.back_drive(settled_loops(posterior, loop_grid(posterior, RATED, (0.06,)), SLOW), load)
    for row in loads_json(posterior, [load]):
        assert row["theta_L_rad"]["median"] == pytest.approx(np.median(angle), rel=1e-6)
        assert row["W_L_J"]["median"] == pytest.approx(np.median(energy), rel=1e-3)
        assert row["theta_L_rad"]["lo"] < row["theta_L_rad"]["median"] < row["theta_L_rad"]["hi"]


def test_every_measured_rate_answers_from_its_largest_loop(posterior):
    rows = loads_json(posterior, [0.03, 0.06])
    assert [row["load_Nm"] for row in rows] == [0.03, 0.03, 0.06, 0.06]
    assert [row["loading_rate_Nm_per_s"] for row in rows[:2]] == pytest.approx([SLOW, FAST])
    assert [row["records"] for row in rows[:2]] == [["record-1"], ["record-2"]]
    assert not any(row["predicted"] for row in rows)


def test_more_load_turns_and_absorbs_more(posterior):
    rows = loads_json(posterior, [0.02, 0.05, RATED, 1.5 * RATED, 2.5 * RATED], SLOW)
    for name in ("theta_L_rad", "W_L_J"):
        medians = [row[name]["median"] for row in rows]
        assert medians == sorted(medians) and medians[0] < 0.8 * medians[-1]


def test_beyond_the_largest_torque_the_last_slope_goes_on(posterior):
    at, beyond, far = (loads_json(posterior, [f * RATED], SLOW)[0]["theta_L_rad"]["median"] for f in (1.0, 1.2, 1.4))
    assert far - beyond == pytest.approx(beyond - at, rel=0.1) and beyond - at == pytest.approx(0.2 * RATED * 0.1, rel=0.1)


def test_a_rate_between_two_rests_on_both_and_one_outside_is_wider(posterior):
    at, between, outside = (loads_json(posterior, [0.06], rate)[0] for rate in (SLOW, 0.06, 10 * FAST))
    assert (len(at["records"]), len(between["records"]), len(outside["records"])) == (1, 2, 1)
    assert at["predicted"] == [] and between["predicted"] == outside["predicted"] == ["loading_rate"]
    assert width(outside["W_L_J"]) > 5 * width(between["W_L_J"])
    assert between["W_L_J"]["median"] == pytest.approx(at["W_L_J"]["median"], rel=0.01)


def test_a_load_beyond_the_measured_amplitude_is_wider(posterior):
    at, beyond = loads_json(posterior, [RATED, 2 * RATED], SLOW)
    assert at["predicted"] == [] and beyond["predicted"] == ["load"]
    assert width(beyond["W_L_J"]) > 5 * width(at["W_L_J"])


def test_an_absurd_load_is_refused(posterior):
    with pytest.raises(BadInput, match="3 times the rated torque, 0.3 N·m, found -0.31"):
        loads_json(posterior, [-0.31])
