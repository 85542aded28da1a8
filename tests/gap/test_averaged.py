"""Averaging over hypotheses: draws in proportion to their probabilities, chains and groups kept."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_posterior import made_posterior
from support.planted import UNITS

from backdrive_bayes.gap import averaged
from backdrive_bayes.gap.averaged import mixed


def marked(value, **options):
    """A posterior all of whose log densities are ``value``."""
    found = made_posterior(**options)
    return replace(found, log_density=np.full(found.shape, float(value)))


@pytest.mark.parametrize("share", [0.5, 0.8])
def test_draws_come_in_proportion(share):
    found = mixed([(marked(1), share), (marked(2, seed=1), 1 - share)])
    assert found.shape == marked(1).shape
    assert np.mean(found.log_density == 1.0) == pytest.approx(share, abs=0.02)
    for name, weights in found.weights.items():
        assert weights.shape == marked(1).weights[name].shape
    own = found.log_density == 2.0
    there = made_posterior(seed=1).weights["elastic"].reshape(-1, found.weights["elastic"].shape[-1])
    assert np.isin(found.weights["elastic"][own][:, 0], there[:, 0]).all(), "a draw's weights and density belong together"


def test_every_chain_holds_every_hypothesis():
    found = mixed([(marked(1), 0.9), (marked(2), 0.1)])
    assert np.all((found.log_density == 2.0).any(axis=1)) and np.all((found.log_density == 1.0).any(axis=1))


def test_one_hypothesis_is_its_own_average():
    only = marked(1)
    assert mixed([(only, 0.4)]) is only


def test_groups_that_not_all_have_are_left_out():
    second = marked(2)
    fewer = replace(second, weights={n: w for n, w in second.weights.items() if n != "sensor_lag"})
    assert "sensor_lag" not in mixed([(marked(1), 0.5), (fewer, 0.5)]).weights


def test_the_worst_convergence_is_told():
    bad = marked(2)
    bad = replace(bad, convergence=replace(bad.convergence, rhat=np.full(len(bad.convergence.names), 1.5)))
    for drawn in ([(marked(1), 0.5), (bad, 0.5)], [(bad, 0.5), (marked(1), 0.5)]):
        assert not mixed(drawn).converged
    assert mixed([(marked(1), 0.5), (marked(2), 0.5)]).converged


def test_a_diagnosis_goes_on_from_the_fit_of_the_same_files(monkeypatch):
    """Weighed once for one set of files; anew where a file or the unit differs, or where no file is known."""
    calls = []
    monkeypatch.setattr(averaged, "prepare", lambda unit, *rest: calls.append(unit.name))
    monkeypatch.setattr(averaged, "weigh", lambda linears, allowed: object())
    monkeypatch.setattr(averaged, "_LAST", {})
    made = UNITS["none"]()
    read = replace(made, file_sha256="a")
    assert averaged.weighed_unit(read) is averaged.weighed_unit(read) and len(calls) == 1
    averaged.weighed_unit(replace(read, file_sha256="c"))
    averaged.weighed_unit(replace(read, file_sha256="c", records=read.records[:1]))
    averaged.weighed_unit(made)
    averaged.weighed_unit(made)
    assert len(calls) == 5
