"""B = (θ_L, W_L) for chosen loads and rates: at hand by measurement, between measured rates, and beyond what was measured."""

import numpy as np
import pytest
from support.bench import unit_of
from support.known import RATED, SCALE, reducer, settled_loops, typical_values

from backdrive_bayes.bench.known_truth import BenchNoise, simulate_unit
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators import indicators as ind
from backdrive_bayes.indicators.loads import loads_json
from backdrive_bayes.indicators.loop import torque_grid
from backdrive_bayes.indicators.other_loops import OtherLoops
from backdrive_bayes.inference.fit import fit
from backdrive_bayes.inference.sampling import Settings

SLOW, FAST = 0.02, 0.2


@pytest.fixture(scope="module")
def posterior():
    """A unit measured at two rates, and at the slow one with a smaller loop too."""
    values = [typical_values(reducer())] * 3
    loops = [(0.5 * RATED, SLOW), (RATED, SLOW), (RATED, FAST)]
    unit = simulate_unit(reducer(), values, loops, BenchNoise(), np.random.default_rng(3))
    settings = Settings(max_seconds=0.0, block=30, kept_per_ensemble=300)
    return fit(unit, seed=1, settings=settings, scale=SCALE)


@pytest.fixture(scope="module")
def truth():
    one = {k: np.array([[v]]) for k, v in typical_values(reducer()).items()}
    return settled_loops(reducer(), one, torque_grid(RATED, (0.06,)))


def width(entry):
    return (entry["hi"] - entry["lo"]) / abs(entry["median"])


@pytest.mark.parametrize("load", [0.06, -0.06, RATED])
def test_b_is_that_of_the_true_loop(posterior, truth, load):
    angle, energy = ind.back_drive(truth, load)
    for row in loads_json(posterior, [load]):
        assert row["theta_L_rad"]["median"] == pytest.approx(angle[0], rel=0.01)
        assert row["W_L_J"]["median"] == pytest.approx(energy[0], rel=0.01)
        assert row["theta_L_rad"]["lo"] < row["theta_L_rad"]["median"] < row["theta_L_rad"]["hi"]


def test_every_measured_rate_answers_from_its_largest_loop(posterior):
    rows = loads_json(posterior, [0.03, 0.06])
    assert [row["load_Nm"] for row in rows] == [0.03, 0.03, 0.06, 0.06]
    assert [row["loading_rate_Nm_per_s"] for row in rows[:2]] == pytest.approx([SLOW, FAST], rel=0.02)
    names = [d.blocks.name for d in posterior.problem.records]
    assert [row["records"] for row in rows[:2]] == [[names[1]], [names[2]]]
    assert not any(row["predicted"] for row in rows)


def test_more_load_turns_and_absorbs_more(posterior):
    rows = loads_json(posterior, [0.02, 0.05, RATED, 1.5 * RATED], SLOW)
    for name in ("theta_L_rad", "W_L_J"):
        medians = [row[name]["median"] for row in rows]
        assert medians == sorted(medians) and medians[0] < 0.8 * medians[-1]


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


def test_the_rate_reaches_the_model():
    """With delayed compliance a loop that is run slowly is larger."""
    settings = Settings(max_seconds=0.0, block=30, kept_per_ensemble=200)
    model = ("geometric", "elastic", "friction", "viscoelastic_creep")
    creeping = fit(unit_of(2, rate=0.05), baseline=model, seed=1, settings=settings, scale=SCALE)
    other = OtherLoops(creeping, 0, np.arange(50))
    slow, own, same = (ind.peak_angle_rad(other.of(RATED, (), rate)) for rate in (1e-3, None, 0.05))
    assert (slow > own).all() and np.median(slow / own) > 1.01
    np.testing.assert_allclose(same, own, rtol=1e-4)
