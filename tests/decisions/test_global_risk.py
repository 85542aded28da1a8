"""Global risks against JCGM 106:2012, another implementation's documented numbers, and independent integration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.optimize import brentq
from scipy.stats import norm

from backdrive_bayes.decisions.global_risk import Process, global_risks, process_of_batch

INF = np.inf
BEARING = Process(1.0, 0.5, "gamma")
"""JCGM 106:2012, 9.5.4: radial error motion of ball bearings, gamma with mean 1 µm and sd 0.5 µm; limit 2 µm, u = 0.25 µm."""


def guarded_limit(process, uncertainty, limit, target):
    """The acceptance interval, both sides moved alike, whose global consumer's risk is ``target``. JCGM 106:2012, 9.5.4."""
    lo, hi = limit

    def excess(guard):
        return global_risks(process, uncertainty, limit, (lo + guard, hi - guard)).consumer - target

    widest = 0.5 * (hi - lo) * (1 - 1e-9) if np.isfinite(lo) and np.isfinite(hi) else 9.0 * uncertainty
    guard = brentq(excess, -9.0 * uncertainty, widest)
    return lo + guard, hi - guard


def test_the_ball_bearings_of_9_5_4():
    risks = global_risks(BEARING, 0.25, (-INF, 2.0), (-INF, 2.0))
    assert risks.nonconforming == pytest.approx(0.042, abs=0.0005)
    assert risks.consumer == pytest.approx(0.008, abs=0.0005)
    assert guarded_limit(BEARING, 0.25, (-INF, 2.0), 0.001)[1] == pytest.approx(1.67, abs=0.005)


def test_the_same_example_as_another_implementation_documents_it():
    """Suncal's guide works 9.5.4: 0.04238011199 out of limits, consumer's risk 0.00801911188, acceptance limit 1.67182877."""
    risks = global_risks(BEARING, 0.25, (-INF, 2.0), (-INF, 2.0))
    assert risks.nonconforming == pytest.approx(0.04238011199, abs=1e-10)
    assert risks.consumer == pytest.approx(0.00801911188, abs=1e-10)
    assert guarded_limit(BEARING, 0.25, (-INF, 2.0), 0.001)[1] == pytest.approx(1.67182877, abs=1e-7)


def test_deavers_figures():
    """Deaver, as Suncal's tests quote him: ±2 sd, uncertainty ratio 4: 0.8 % and 1.5 %; ratio 2 guarded by 0.91: 0.8 %, 6.6 %."""
    plain = global_risks(Process(0, 1), 0.25, (-2, 2), (-2, 2))
    assert (plain.consumer, plain.producer) == (pytest.approx(0.008, abs=1e-4), pytest.approx(0.015, abs=5e-4))
    guarded = global_risks(Process(0, 1), 0.5, (-2, 2), (-1.82, 1.82))
    assert (guarded.consumer, guarded.producer) == (pytest.approx(0.008, abs=5e-4), pytest.approx(0.066, abs=1e-3))


@pytest.mark.parametrize("shape", ["normal", "lognormal", "gamma"])
def test_against_a_double_integral_over_process_and_reading(shape):
    process, u, hi, accept, reject = Process(1.0, 0.3, shape), 0.1, 1.4, 1.25, 1.5
    d = process.distribution

    def both(y, x):
        return d.pdf(x) * norm.pdf(y, x, u)

    risks = global_risks(process, u, (-INF, hi), (-INF, accept), (-INF, reject))
    consumer = dblquad(both, hi, 4.0, lambda x: min(x - 9 * u, accept), lambda x: accept, epsabs=1e-9)[0]
    producer = dblquad(both, d.ppf(1e-12), hi, lambda x: reject, lambda x: max(x + 9 * u, reject), epsabs=1e-9)[0]
    assert risks.consumer == pytest.approx(consumer, abs=2e-7)
    assert risks.producer == pytest.approx(producer, abs=2e-7)
    assert d.mean() == pytest.approx(1.0) and d.std() == pytest.approx(0.3)


@pytest.mark.parametrize(("shape", "sd"), [("gamma", 1.5), ("gamma", 4.0), ("lognormal", 6.0)])
def test_a_process_wider_than_its_mean_keeps_all_its_mass(shape, sd):
    """Integrated over the quantity itself (planted fault), most of a density that is not bounded at zero, or ends far out, is
    missed."""
    process = Process(1.0, sd, shape)
    d, rng = process.distribution, np.random.default_rng(4)
    risks = global_risks(process, 0.1, (-INF, 2.0), (-INF, 1.9))
    assert risks.accepted + risks.rejected == pytest.approx(1.0, abs=1e-9)
    assert risks.nonconforming == pytest.approx(d.sf(2.0), rel=1e-9)
    truth = d.rvs(400_000, random_state=rng)
    reading = truth + rng.normal(0, 0.1, truth.size)
    for found, hits in ((risks.consumer, (truth > 2) & (reading <= 1.9)), (risks.producer, (truth <= 2) & (reading > 1.9))):
        assert found == pytest.approx(hits.mean(), abs=4 * np.sqrt(max(found, 1e-6) / truth.size))


def test_against_simulated_production():
    rng = np.random.default_rng(3)
    truth = rng.normal(1.0, 0.2, 400_000)
    reading = truth + rng.normal(0, 0.1, truth.size)
    risks = global_risks(Process(1.0, 0.2), 0.1, (0.7, 1.3), (0.8, 1.2), (0.6, 1.4))
    inside = (truth >= 0.7) & (truth <= 1.3)
    accepted, rejected = (reading >= 0.8) & (reading <= 1.2), (reading < 0.6) | (reading > 1.4)
    told = risks.to_json()
    for key, hits in (
        ("consumer", accepted & ~inside), ("producer", rejected & inside), ("nonconforming", ~inside), ("accepted", accepted),
        ("rejected", rejected), ("inconclusive", ~accepted & ~rejected),
    ):  # fmt: skip
        assert told[key] == pytest.approx(hits.mean(), abs=5 * np.sqrt(max(hits.mean(), 1e-5) / truth.size)), key


@settings(max_examples=30, deadline=None)
@given(st.floats(-2, 2), st.floats(0.2, 2), st.floats(0.01, 1), st.floats(0.2, 3), st.floats(0, 0.5))
def test_laws(mean, sd, u, limit, guard):
    process = Process(mean, sd)
    plain = global_risks(process, u, (-limit, limit), (-limit, limit))
    guarded = global_risks(process, u, (-limit, limit), (guard - limit, limit - guard) if guard < limit else None)
    assert guarded.consumer <= plain.consumer + 1e-12, "a guard band never adds to the consumer's risk"
    assert guarded.producer >= plain.producer - 1e-12, "and never takes from the producer's"
    assert plain.accepted + plain.rejected == pytest.approx(1.0, abs=1e-6)
    assert plain.consumer <= plain.nonconforming + 1e-12
    assert plain.nonconforming == pytest.approx(1 - norm.cdf(limit, mean, sd) + norm.cdf(-limit, mean, sd), abs=1e-6)


def test_accepting_nothing_has_no_consumers_risk():
    nothing = global_risks(Process(0, 1), 0.1, (-1, 1), None, (INF, -INF))
    assert nothing.consumer == 0.0 and nothing.accepted == 0.0


def test_a_batch_gives_the_process_with_the_measurement_taken_out():
    rng = np.random.default_rng(1)
    found = process_of_batch(5 + rng.normal(0, 2, 4000) + rng.normal(0, 1, 4000), np.full(4000, 1.0))
    assert (found.mean, found.sd) == (pytest.approx(5, abs=0.15), pytest.approx(2, abs=0.1))
    assert process_of_batch([1.0, 1.1, 0.9], [1.0, 1.0, 1.0]).sd > 0
