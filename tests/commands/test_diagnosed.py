"""A diagnosis says whether its posterior may be used, also where that is not kept."""

from types import SimpleNamespace

import pytest
from support.decided import diagnosis
from support.made_posterior import made_posterior

from backdrive_bayes.commands.results import FitOptions, diagnose_unit
from backdrive_bayes.gap import diagnose
from backdrive_bayes.indicators import convergence

UNIT = SimpleNamespace(name="u", data_sha256=("0" * 64,), file_sha256="")


@pytest.fixture
def found(monkeypatch):
    """A diagnosis whose sampling came out well, of a unit of which nothing was measured."""
    result = SimpleNamespace(json=diagnosis(), posterior=made_posterior(spread=0.02))
    monkeypatch.setattr(diagnose, "diagnose", lambda unit, **options: result)
    monkeypatch.setattr(convergence, "measured_loops", lambda unit: ())
    return result


def test_what_the_measurement_contradicts_is_inconclusive_without_the_posterior_too(found, monkeypatch):
    result, sampled = diagnose_unit(UNIT, FitOptions(), sample=False)
    assert sampled is None and not result["convergence"]["contradictions"]
    said = "loop area S of r.csv was measured as 4 J, inferred as 1 to 2 J"
    monkeypatch.setattr(convergence, "contradictions", lambda *about: [said])
    result, _ = diagnose_unit(UNIT, FitOptions(), sample=False)
    assert result["outcome"]["word"] == "inconclusive" and result["outcome"]["exit_code"] == 4
    assert said in result["outcome"]["reason"] and not result["convergence"]["converged"]
