"""Risk arithmetic against JCGM 106:2012, closed forms, and its own laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from backdrive_bayes.decisions.conformance import (
    Risks,
    Verdict,
    acceptance_interval,
    conformance_probability,
    guard_bands,
    monte_carlo_error,
    normal_conformance,
)

NORMAL = norm.ppf((np.arange(20_000) + 0.5) / 20_000)
"""A normal sample without sampling error."""


# JCGM 106:2012, examples of clause 7: a Zener diode of -5.47 V with u = 0.05 V against at most -5.40 V has
# p_c = Φ(1.40) = 0.92; a motor oil of 13.6 mm²/s with u = 1.8 mm²/s against 12.5 to 16.3 mm²/s has p_c = Φ(1.5) - Φ(-0.6) = 0.66.
@pytest.mark.parametrize(("estimate", "u", "lo", "hi", "p"), [(-5.47, 0.05, -np.inf, -5.40, 0.92), (13.6, 1.8, 12.5, 16.3, 0.66)])
def test_worked_examples_of_clause_7(estimate, u, lo, hi, p):
    assert normal_conformance(estimate, u, lo, hi) == pytest.approx(p, abs=0.005)
    assert conformance_probability(estimate + u * NORMAL, lo, hi) == pytest.approx(p, abs=0.005)


# The one-sided limits of clause 7: distance to the limit in standard uncertainties against p_c.
@pytest.mark.parametrize(("p", "z"), [(0.80, 0.84), (0.90, 1.28), (0.95, 1.64), (0.99, 2.33), (0.999, 3.09)])
def test_one_sided_limits(p, z):
    assert normal_conformance(0.0, 1.0, hi=z) == pytest.approx(p, abs=0.0021)
    assert guard_bands(5 + 2 * NORMAL, 1 - p)[0] == pytest.approx(2 * z, abs=0.02)
    assert acceptance_interval(1.0, -np.inf, 10.0, p)[1] == pytest.approx(10 - z, abs=0.006)


def test_a_guard_band_of_two_standard_uncertainties_leaves_2_3_per_cent():
    """JCGM 106:2012, 8.3.2: with w = U = 2u the conformance probability of an accepted item is at least 97.7 %."""
    assert normal_conformance(10 - 2 * 0.5, 0.5, hi=10.0) == pytest.approx(0.977, abs=0.0005)


def test_two_sided_acceptance_is_where_the_conformance_is_reached():
    low, high = acceptance_interval(0.5, 0.0, 4.0, 0.95)
    assert normal_conformance(high, 0.5, 0.0, 4.0) == pytest.approx(0.95, abs=1e-9) and low == pytest.approx(4 - high)
    assert acceptance_interval(3.0, 0.0, 4.0, 0.95) is None, "an uncertainty as wide as the limits accepts nothing"
    low, high = acceptance_interval(0.5, 0.0, 4.0, 1e-30)
    assert 4.0 + 11 * 0.5 < high < 4.0 + 13 * 0.5, "however small a probability is asked for"


draws = st.lists(st.floats(-10, 10), min_size=1, max_size=60).map(np.array)
limits = st.tuples(st.floats(-8, 8), st.floats(0.01, 5)).map(lambda x: (x[0], x[0] + x[1]))


@given(draws, limits, st.floats(0, 3))
def test_wider_limits_never_conform_less(values, limit, more):
    lo, hi = limit
    assert conformance_probability(values, lo - more, hi + more) >= conformance_probability(values, lo, hi)


@given(draws, limits)
def test_probabilities_are_never_certain_and_add_up(values, limit):
    lo, hi = limit
    inside = conformance_probability(values, lo, hi)
    assert 0 < inside < 1
    outside = ((values < lo) | (values > hi)).sum()
    assert inside + (outside + 0.5) / (values.size + 1) == pytest.approx(1.0)


@given(draws, limits, st.floats(0.1, 10), st.floats(-5, 5))
def test_units_do_not_matter(values, limit, factor, shift):
    inside = (values >= limit[0]) & (values <= limit[1])
    near = np.min(np.abs(values[:, None] - limit)) < 1e-6
    moved = conformance_probability(factor * values + shift, *(factor * e + shift for e in limit))
    assert near or moved == pytest.approx((inside.sum() + 0.5) / (values.size + 1))


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0.001, 0.49), st.floats(0.001, 0.49))
def test_a_unit_is_never_both_accepted_and_rejected(conformance, unknown, consumer, producer):
    unknown = min(unknown, 1 - conformance)
    risks = Risks(conformance, unknown)
    verdict = risks.verdict(consumer, producer)
    assert (verdict is Verdict.ACCEPTED) == (1 - conformance <= consumer)
    if verdict is Verdict.REJECTED:
        assert conformance + unknown <= producer
    stricter = risks.verdict(consumer / 2, producer / 2)
    assert stricter in (verdict, Verdict.INCONCLUSIVE), "smaller agreed risks only take decisions back"


@given(st.floats(0, 0.5), st.floats(0, 1))
def test_what_is_unknown_counts_against_both_decisions(unknown, share):
    known, told = Risks(share), Risks(share * (1 - unknown), unknown)
    assert told.consumer >= known.consumer - 1e-12 and told.producer >= known.producer - 1e-12


def test_exit_codes_and_errors():
    assert [v.exit_code for v in Verdict] == [0, 3, 4]
    assert monte_carlo_error(0.5, 2500) == pytest.approx(0.01) and monte_carlo_error(0.1, 0) < 1
