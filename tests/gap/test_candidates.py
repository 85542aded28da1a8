"""Bookkeeping of the hypotheses, with fits that are made up: what is tried, kept, left out and told of the search."""

from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.gap import candidates as module
from backdrive_bayes.gap import fast as fast_module
from backdrive_bayes.gap.candidates import Candidates, Weighed
from backdrive_bayes.gap.fast import Fast, weigh_fast


class Peak:
    """A fitted hypothesis of which nothing is known but its height."""

    def __init__(self, effects, height):
        self.effects, self.height = tuple(effects), height
        self.z, self.problem = np.array([height]), SimpleNamespace(log_posterior=lambda z: np.asarray(z)[:, 0])


def weighed(**heights):
    """Hypotheses by name and height; pairs are written a__b, ``none`` is the baseline."""
    names = {name: tuple(n for n in name.split("__") if n != "none") for name in heights}
    return [weigh(None, Peak(names[name], height)) for name, height in heights.items()]


def weigh(setting, peak):
    return Weighed(peak, np.array([[peak.height]]))


@pytest.fixture
def gains(monkeypatch):
    """What every fresh search gains, in the order of the searches; nothing after the last."""
    left = []
    climb = lambda peak, rng: Peak(peak.effects, peak.height + (left.pop(0) if left else 0.0))  # noqa: E731
    monkeypatch.setattr(module, "polished", climb)
    monkeypatch.setattr(module, "rebased", lambda peak, other: peak)
    monkeypatch.setattr(module, "_weigh", weigh)
    return left


def test_what_the_last_search_gained_is_told_and_kept_within_the_lead_too(gains):
    gains[:] = [90.0]
    found, regained, sought = module._settle(None, weighed(none=0.0, sensor_lag=300.0, thermal_drift=100.0), None)
    assert (regained, sought) == (90.0, ("sensor_lag",))
    assert {w.effects: w.height for w in found} == {(): 0.0, ("sensor_lag",): 390.0, ("thermal_drift",): 100.0}


def test_a_search_that_finds_more_goes_on_until_it_does_not(gains):
    gains[:] = [50.0, 60.0, 1.0]
    _, regained, _ = module._settle(None, weighed(none=0.0, sensor_lag=30.0), None)
    assert regained == 1.0
    gains[:] = [1000.0] * 20
    assert module._settle(None, weighed(none=0.0, sensor_lag=30.0), None)[1] == 1000.0


def test_the_best_without_a_module_are_tried_with_it(gains, monkeypatch):
    monkeypatch.setattr(module, "screen", lambda setting, known, name, *rest: known)
    monkeypatch.setattr(module, "fit_screened", lambda known, effects, rng: Peak(effects, known.height + 5.0))
    setting = SimpleNamespace(whitening=lambda reference: None)
    known = weighed(none=0.0, geometric=20.0, sensor_lag=30.0, thermal_drift=10.0, stick_slip=1.0, geometric__sensor_lag=40.0)
    found = {frozenset(w.effects): w.height for w in module._completed(setting, known, "geometric", None)}
    assert found[frozenset(["geometric", "sensor_lag"])] == 40.0, "what is there is left alone"
    assert found[frozenset(["geometric", "thermal_drift"])] == 15.0
    assert frozenset(["geometric", "stick_slip"]) in found and len(found) == len(known) + 2


@pytest.mark.parametrize(("teeth", "left_out"), [(300.0, True), (150.0, False), (-3.0, False)])
def test_teeth_that_an_encoder_error_has_taken_are_given_back(monkeypatch, teeth, left_out):
    """The planted fault: to keep the wide blocks' evidence of the encoder error that the teeth brought about."""

    def beside(setting, peak):
        return Fast({"encoder_error": -3.0, "stick_slip": -3.0 if "encoder_error" in peak.effects else teeth}, {})

    monkeypatch.setattr(fast_module, "_weigh_beside", beside)
    known = Candidates(tuple(weighed(none=0.0, encoder_error=250.0, sensor_lag=50.0)), {("encoder_error",): np.zeros(1)})
    fast, kept = weigh_fast(None, known)
    names = {w.effects for w in kept.weighed}
    assert (("encoder_error",) not in names) == left_out == (("encoder_error",) not in kept.unexplained)
    assert fast.log_evidence["stick_slip"] == (teeth if left_out else -3.0)
