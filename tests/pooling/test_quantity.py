"""One quantity over a batch: recovery of what was put in, the prior taken out, shrinking, and what is refused."""

import numpy as np
import pytest
from scipy.stats import binom

from backdrive_bayes.pooling.loss import MOST_BITS, fit_loss
from backdrive_bayes.pooling.mixture import Mixture
from backdrive_bayes.pooling.quantity import likelihood, pool_quantity

LEVEL, DRAWS = 0.9, 600


def batch(units, spread, seed, own=0.2, factor=1.0, prior=(0.0, 20.0)):
    """Log draws of units near 1 with their prior's: names, draws, priors. ``factor`` narrows the draws about their mean."""
    rng = np.random.default_rng([seed, units])
    reading = spread * rng.standard_normal(units) + own * rng.standard_normal(units)
    gain = own**2 / (own**2 + prior[1] ** 2)
    centre, sd = reading + gain * (prior[0] - reading), own * np.sqrt(1 - gain)
    draws = [np.exp(c + factor * sd * rng.standard_normal(DRAWS)) for c in centre]
    return [f"u{i}" for i in range(units)], draws, [np.exp(rng.normal(*prior, 600)) for _ in range(units)]


def coverage(count, spread, **options):
    """Share of batches of 12 units whose intervals of mean and spread hold the truth."""
    found = [pool_quantity(*batch(12, spread, seed, **options), seed, LEVEL) for seed in range(count)]
    held = [(f["mean"]["lo"] <= 1 <= f["mean"]["hi"], f["spread"]["lo"] <= spread <= f["spread"]["hi"]) for f in found]
    return np.mean(held, axis=0)


def lowest(count):
    return binom.ppf(0.005, count, LEVEL) / count


def test_intervals_of_mean_and_spread_hold_the_truth():
    for spread in (0.02, 0.6):
        assert (coverage(12, spread) >= lowest(12)).all()


def test_posteriors_of_half_their_width_do_not():
    """The planted fault: a spread is found that is not there."""
    assert coverage(12, 0.02, factor=0.5)[1] < lowest(12)


def test_a_prior_is_divided_out_and_left_in_it_shows():
    tight = {"prior": (1.0, 0.6)}
    assert coverage(8, 0.02, **tight)[0] >= lowest(8)
    names, draws, _ = batch(40, 0.02, 1, **tight)
    flat = [np.exp(np.random.default_rng(i).normal(0, 100, 600)) for i in range(40)]
    left_in = pool_quantity(names, draws, flat, 1, LEVEL)
    assert not left_in["mean"]["lo"] <= 1 <= left_in["mean"]["hi"]
    row = pool_quantity(*batch(40, 0.02, 1, **tight), 1, LEVEL)["of_units"][0]
    assert row["prior_shift_sd"] > 0.2, "the prior's pull is said"


def test_alike_units_are_shrunk_and_different_ones_are_not():
    alike = pool_quantity(*batch(12, 0.02, 5), 0, LEVEL)
    apart = pool_quantity(*batch(12, 4.0, 5), 0, LEVEL)

    def narrowing(found):
        return np.median([np.log(r["pooled"]["hi"] / r["pooled"]["lo"]) / np.log(r["own"]["hi"] / r["own"]["lo"])
                          for r in found["of_units"] if r["pooled"]])  # fmt: skip

    assert narrowing(alike) < 0.75 and narrowing(apart) == pytest.approx(1.0, abs=0.05)
    assert alike["next_unit"]["lo"] < alike["mean"]["lo"] and alike["next_unit"]["hi"] > alike["mean"]["hi"]
    assert alike["loss_bits"] < MOST_BITS and alike["scale"] == "log"


def test_same_seed_same_numbers_and_negative_draws_are_pooled_as_they_are():
    names, draws, priors = batch(6, 0.3, 2)
    logs = [np.log(d) for d in draws], [np.log(p) for p in priors]
    linear = pool_quantity(names, *logs, 0, LEVEL)
    positive = pool_quantity(names, draws, priors, 0, LEVEL)
    assert linear["scale"] == "linear" and positive["spread"] == linear["spread"]
    assert np.log(positive["mean"]["median"]) == pytest.approx(linear["mean"]["median"])
    assert pool_quantity(names, draws, priors, 0, LEVEL) == positive


def test_a_unit_far_from_its_batch_has_no_pooled_interval():
    names, draws, priors = batch(40, 0.02, 3, own=0.05)
    draws[7] = draws[7] * np.exp(0.4)
    found = pool_quantity(names, draws, priors, 0, LEVEL)
    row = found["of_units"][7]
    assert row["pooled"] is None and row["loss_bits"] > MOST_BITS and "pool the batch without it" in row["refused"]
    assert sum(r["pooled"] is None for r in found["of_units"]) <= 2


def test_a_loss_beyond_what_is_allowed_refuses_the_quantity_and_names_the_unit():
    """A heavy-tailed unit twenty standard deviations away: its few draws near the batch do not say what it would be there."""
    names, draws, priors = batch(20, 0.02, 3, own=0.05)
    draws[4] = np.exp(1.0 + 0.05 * np.random.default_rng(0).standard_t(2.5, DRAWS))
    found = pool_quantity(names, draws, priors, 0, LEVEL)
    assert found["loss_bits"] > MOST_BITS and "mean" not in found and all(r["pooled"] is None for r in found["of_units"])
    assert "bit are lost by re-weighting stored draws (at most 0.2), most of it by u4" in found["refused"]


def test_a_unit_that_only_repeats_its_prior_is_left_out():
    names, draws, priors = batch(8, 0.1, 4)
    rng = np.random.default_rng(0)
    draws[2], priors[2] = np.exp(rng.normal(0, 1, DRAWS)), np.exp(rng.normal(0, 1, 600))
    tight = np.exp(rng.normal(4, 0.25, 600))
    draws[3], priors[3] = np.exp(rng.normal(3, 0.245, DRAWS)), tight
    found = pool_quantity(names, draws, priors, 0, LEVEL)
    assert found["of_units"][3]["refused"].startswith("left out") and found["units"] < 8
    assert "its prior had moved it by" in found["of_units"][3]["refused"]


def test_a_unit_whose_draws_pile_up_at_an_end_is_left_out():
    """What is cut would go in as a narrow hump, and the batch would follow it."""
    names, draws, priors = batch(8, 0.1, 4)
    draws[5] = np.maximum(draws[5], np.quantile(draws[5], 0.1))
    found = pool_quantity(names, draws, priors, 0, LEVEL)
    assert found["units"] == 7 and "10 % of its draws lie at the end of the range" in found["of_units"][5]["refused"]
    cut = [np.maximum(p, np.median(p)) for p in priors]
    assert pool_quantity(names, draws, cut, 0, LEVEL)["units"] == 7, "a cut prior is no matter"


def test_fewer_than_five_units_are_refused():
    found = pool_quantity(*batch(4, 0.1, 0), 0, LEVEL)
    assert "5 are needed" in found["refused"] and "mean" not in found


def test_the_loss_sees_a_mixture_that_does_not_fit():
    """Two humps told by one normal distribution lose what theory has; the right mixture loses what finite draws do."""
    rng = np.random.default_rng(0)
    x = np.where(rng.random(4000) < 0.5, -1.0, 1.0) + 0.3 * rng.standard_normal(4000)
    one = Mixture(np.ones(1), np.array([x.mean()]), np.array([x.std()]))
    grid = np.linspace(-6, 6, 40_001)
    two = Mixture(np.full(2, 0.5), np.array([-1.0, 1.0]), np.full(2, 0.3))
    density = np.exp(two.log_density(grid))
    whole = np.trapezoid(density * (two.log_density(grid) - one.log_density(grid)), grid) / np.log(2)
    assert MOST_BITS < fit_loss(one, x, np.ones(x.size)) == pytest.approx(whole, rel=0.1)
    expected = 19 / (2 * x.size * np.log(2))
    assert fit_loss(two, x, np.ones(x.size)) == pytest.approx(expected, abs=3 * expected)


def test_what_is_taken_out_is_the_prior():
    """Posterior of a normal reading under a normal prior: the likelihood comes back."""
    rng = np.random.default_rng(1)
    prior, reading, own = (2.0, 1.0), 0.0, 0.5
    gain = own**2 / (own**2 + prior[1] ** 2)
    x = reading + gain * (prior[0] - reading) + own * np.sqrt(1 - gain) * rng.standard_normal(4000)
    found = likelihood(x, rng.normal(*prior, 4000))
    assert found.mixture.moments == pytest.approx((reading, own), abs=0.05)
    assert found.prior_shift == pytest.approx(gain * 2.0 / (own * np.sqrt(1 - gain)), abs=0.1)
