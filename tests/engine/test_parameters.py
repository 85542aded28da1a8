"""The user's parameters are those of the reducer that the operator was made from."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_posterior import known, made_posterior

from backdrive_bayes.engine.parameters import PARAMETERS, Operator, implied_prior, posterior_parameters
from backdrive_bayes.mechanics.reducer import ReducerClass

TORQUE, ANGLE = 0.1, 0.02


def medians(**options):
    found = posterior_parameters(made_posterior(known(**options)))
    return {name: np.median(values) for name, values in found.items()}


def test_every_parameter_of_a_physical_reducer_is_recovered():
    found = medians(clearance=0.8, drag=0.06, engagement=0.2, compliance=0.4, friction=0.3, threshold=0.04, spread=0.5)
    assert found["clearance_rad"] == pytest.approx(0.8 * ANGLE, rel=0.01)
    assert found["drag_torque_Nm"] == pytest.approx(0.06 * TORQUE, rel=0.01)
    assert found["engagement_width_Nm"] == pytest.approx(0.2 * 0.06 * TORQUE, rel=0.03)
    # Plays of small read-outs have turned long before the rated torque: what yields there is the elastic part.
    assert found["compliance_rated_rad_per_Nm"] == pytest.approx(0.4 * ANGLE / TORQUE, rel=0.02)
    assert found["friction_torque_Nm"] == pytest.approx(0.04 * np.exp(0.5**2 / 2) * TORQUE, rel=0.02)
    assert found["friction_spread"] == pytest.approx(0.5, rel=0.02)


def test_thresholds_that_no_load_moves_have_no_load_ratio():
    known_ratio = next(p.of for p in PARAMETERS if p.name == "load_friction_ratio")
    truth = known(friction=0.3, threshold=0.04, spread=0.5)
    assert abs(known_ratio(Operator(truth.reducer, {n: w[None] for n, w in truth.weights.items()}, TORQUE, ANGLE, 1.0))[0]) < 0.01


@pytest.mark.parametrize(("option", "name"), [("clearance", "clearance_rad"), ("drag", "drag_torque_Nm")])
def test_a_parameter_grows_with_its_cause_and_leaves_the_rest(option, name):
    small, large = medians(), medians(**{option: {"clearance": 1.8, "drag": 0.1}[option]})
    assert large[name] == pytest.approx(2 * small[name], rel=0.02)
    assert large["friction_torque_Nm"] == pytest.approx(small["friction_torque_Nm"])
    assert large["compliance_rated_rad_per_Nm"] == pytest.approx(small["compliance_rated_rad_per_Nm"], rel=0.01)


def test_modules_that_vanish_have_parameters_at_their_null_value():
    found = medians(clearance=0.0, friction=0.0)
    null = {p.name: p.null for p in PARAMETERS}
    for name in ("clearance_rad", "drag_torque_Nm", "friction_torque_Nm", "hardening"):
        assert found[name] == pytest.approx(null[name], abs=1e-3), name


def test_a_module_that_is_left_out_has_no_parameters():
    posterior = made_posterior()
    bare = ReducerClass(posterior.reducer.knots, ("elastic",))
    found = posterior_parameters(replace(posterior, reducer=bare))
    assert set(found) == {"compliance_zero_rad_per_Nm", "compliance_rated_rad_per_Nm", "hardening"}


def test_negative_weights_give_finite_numbers():
    posterior = made_posterior()
    rng = np.random.default_rng(0)
    for weights in posterior.weights.values():
        weights *= rng.choice([-1.0, 1.0], weights.shape)
    assert all(np.isfinite(v).all() for v in posterior_parameters(posterior).values())


def test_the_implied_prior_is_wide_finite_and_the_same_again():
    posterior = made_posterior()
    found, again = implied_prior(posterior, 200, seed=3), implied_prior(posterior, 200, seed=3)
    own = posterior_parameters(posterior)
    assert set(found) == set(own) and all(np.isfinite(v).all() and v.shape == (200,) for v in found.values())
    assert all(np.array_equal(found[n], again[n]) for n in found)
    assert np.std(found["clearance_rad"]) > 10 * np.std(own["clearance_rad"])


def test_every_parameter_says_what_it_is():
    assert len({p.name for p in PARAMETERS}) == len({p.symbol for p in PARAMETERS}) == len(PARAMETERS) == 9
    assert all(len(p.definition) > 20 and p.unit for p in PARAMETERS)
