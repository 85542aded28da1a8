"""Diagnostics over ensembles: independent draws pass, each kind of trouble is flagged."""

import numpy as np
import pytest

from backdrive_bayes.engine.diagnostics import ADVICE, Convergence, diagnose_draws

ENSEMBLES, WALKERS, STEPS = 4, 64, 15
STEP = np.broadcast_to(np.tile(np.arange(STEPS), WALKERS), (ENSEMBLES, WALKERS * STEPS))


def independent(seed=0, quantities=3):
    return np.random.default_rng(seed).standard_normal((ENSEMBLES, WALKERS * STEPS, quantities))


def converged(draws):
    return diagnose_draws([f"q{k}" for k in range(draws.shape[-1])], draws, STEP, 1).converged


def shifted_ensemble(draws):
    draws[2, :, 1] += 0.5
    return draws


def drifting(draws):
    draws[..., 1] += 0.05 * STEP
    return draws


def other_spread(draws):
    draws[1, :, 1] *= 2.0
    return draws


def stuck_walkers(draws):
    walkers = draws.reshape(ENSEMBLES, WALKERS, STEPS, -1)
    walkers[..., 1] = walkers[:, :, :1, 1]
    return draws


def slow_walkers(draws):
    walkers = draws.reshape(ENSEMBLES, WALKERS, STEPS, -1)
    for k in range(1, STEPS):
        walkers[:, :, k, 1] = 0.98 * walkers[:, :, k - 1, 1] + np.sqrt(1 - 0.98**2) * walkers[:, :, k, 1]
    return draws


@pytest.mark.parametrize("seed", range(5))
def test_independent_draws_pass(seed):
    found = diagnose_draws(("a", "b", "c"), independent(seed), STEP, 2)
    assert found.converged
    assert (found.bulk_ess > 2500).all() and (found.rhat < 1.005).all()
    assert found.to_json()["converged"] and found.to_json()["advice"] == "" and found.to_json()["evaluations"] == 2


@pytest.mark.parametrize("trouble", [shifted_ensemble, drifting, other_spread, stuck_walkers, slow_walkers])
def test_trouble_is_flagged_and_named(trouble):
    found = diagnose_draws(("q0", "q1", "q2"), trouble(independent()), STEP, 1)
    assert not found.converged
    passing = (found.rhat < 1.01) & (found.bulk_ess >= 400) & (found.tail_ess >= 400)
    assert passing.tolist() == [True, False, True]
    told = found.to_json()["advice"]
    assert told.startswith(ADVICE) and "of q1 is" in told and "of q0" not in told and "of q2" not in told


@pytest.mark.parametrize(
    ("rhat", "bulk", "tail", "told"),
    [
        (1.004, 1152.0, 391.04, ("tail ESS 391 of friction is below 400",)),
        (1.004, 399.9, 1000.0, ("bulk ESS 399 of friction is below 400",)),
        (1.0213, 900.0, 900.0, ("R-hat 1.0213 of friction is not below 1.01",)),
        (1.01, 300.0, 900.0, ("R-hat 1.0100 of friction is not below 1.01", "bulk ESS 300 of friction is below 400")),
        (np.inf, np.nan, np.nan, ("friction is not defined in all draws",)),
        (1.004, 900.0, 900.0, ()),
    ],
)
def test_the_advice_names_the_criterion_that_failed(rhat, bulk, tail, told):
    values = (np.array([good, bad, np.nan]) for good, bad in ((1.001, rhat), (2000.0, bulk), (2000.0, tail)))
    found = Convergence(("elastic", "friction", "constant"), *values, 1)
    assert found.failed == told and found.converged == (not told)
    assert found.to_json()["advice"] == (f"{ADVICE}: {', '.join(told)}; check the records" if told else "")


def test_worst_names_the_smallest_ess():
    assert diagnose_draws(("q0", "q1", "q2"), slow_walkers(independent()), STEP, 1).worst == "q1"


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_constant_quantity_is_no_trouble():
    draws = independent()
    draws[..., 2] = 7.0
    found = diagnose_draws(("a", "b", "fixed"), draws, STEP, 1)
    assert found.converged and np.isfinite(found.to_json()["max_rhat"])


def test_a_few_undefined_draws_do_not_pass_as_constant():
    draws = independent()
    draws[0, :3, 1] = np.nan
    assert not converged(draws)


def test_joined_keeps_both_and_the_worse_verdict():
    good = diagnose_draws(("a",), independent(0, 1), STEP, 1)
    bad = diagnose_draws(("b", "c"), shifted_ensemble(independent(1, 2)), STEP, 3)
    both = good.joined(bad)
    assert both.names == ("a", "b", "c") and both.rhat.shape == (3,) and both.evaluations == 3
    assert not both.converged
