"""Drift: alarms come as often as stated where nothing drifts, and come where something does."""

import numpy as np
import pytest
from scipy.stats import binom, norm

from backdrive_bayes.fleet.drift import FEWEST, differences, find_drift

FLEETS, UNITS, RATE = 400, 30, 0.05
NORMAL, HEAVY = (lambda rng, n: rng.standard_normal(n)), (lambda rng, n: rng.standard_cauchy(n))


def alarms(found):
    return sum(f.first is not None for f in found)


def simulated(draw, fleets=FLEETS):
    rng = np.random.default_rng(0)
    return [find_drift(draw(rng, UNITS), RATE, seed=i) for i in range(fleets)]


def within(count, fleets=FLEETS):
    """Whether a count of alarms fits the stated rate, missed once in a thousand times to each side."""
    return binom.ppf(0.001, fleets, RATE) <= count <= binom.ppf(0.999, fleets, RATE)


@pytest.mark.parametrize("draw", [NORMAL, HEAVY], ids=["normal", "Cauchy"])
def test_alarms_without_drift_come_as_often_as_stated(draw):
    found = simulated(draw)
    assert within(alarms(found))
    assert within(sum(f.probability <= RATE for f in found))
    # A limit that holds at one point alone is passed somewhere far too often: the check must see that.
    assert not within(sum(np.abs(f.path).max() > norm.ppf(1 - RATE / 2) for f in found))


def test_correlated_neighbours_would_be_seen():
    """The rate rests on orders being equally probable; where they are not, the check fails."""

    def wander(rng, n):
        return np.cumsum(rng.standard_normal(n))

    assert not within(alarms(simulated(wander, 60)), 60)


@pytest.mark.parametrize("first", [8, 30, 55])
def test_a_shift_is_found_where_it_begins(first):
    rng = np.random.default_rng(first)
    found = find_drift(rng.standard_normal(60) + 3.0 * (np.arange(60) >= first), 0.01 / 3)
    assert found.first is not None and abs(found.first - first) <= 2
    assert found.probability < 0.005 and found.path.max() > found.limit


def test_a_slow_fall_is_found():
    found = find_drift(np.random.default_rng(1).standard_normal(60) - np.linspace(0, 4, 60), 0.01 / 3)
    assert found.first is not None and found.path.min() < -found.limit


def test_one_outlier_is_no_drift():
    values = np.random.default_rng(2).standard_normal(40)
    assert find_drift(values, 0.01).first is None
    values[39] = 1e6
    assert find_drift(values, 0.01).first is None


def test_equal_values_and_few_units():
    assert find_drift(np.ones(20), 0.01).first is None
    assert find_drift(np.arange(FEWEST - 1.0), 0.01) is None and find_drift(np.arange(float(FEWEST)), 0.01) is not None


def test_two_batches_of_six_that_do_not_overlap_are_told_apart():
    found = find_drift([1, 3, 2, 5, 4, 6, 11, 13, 12, 15, 14, 16], 0.01 / 3)
    assert found.first == 6


def test_differences_are_those_of_the_means():
    scores = np.random.default_rng(3).standard_normal(12)
    scores = (scores - scores.mean()) / scores.std()
    path = differences(scores)
    plain = [scores[k:].mean() - scores[:k].mean() for k in range(1, 12)]
    assert path[0] == 0 and np.allclose(path[1:] / plain, [np.sqrt(k * (12 - k) * 11) / 12 for k in range(1, 12)])
    orders = np.random.default_rng(4).permuted(np.tile(scores, (20000, 1)), axis=-1)
    assert np.allclose(differences(orders).std(axis=0)[1:], 1.0, atol=0.03)
