"""Intervals of small units of the class hold their truth as often as they say, and hardly move with the last bits of the data."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import binom, norm
from scipy.stats import t as student
from support.planted import LOOPS, joint_mode, planted, prepared

from backdrive_bayes.bench.known_truth import BenchNoise, random_reducer, simulate_unit
from backdrive_bayes.engine import infer as module
from backdrive_bayes.engine import predictive, proposal, sample
from backdrive_bayes.engine.infer import infer
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.indicators.draws import IndicatorDraws, core_indicators
from backdrive_bayes.indicators.loop import cut_loops, settled_history
from backdrive_bayes.mechanics.registry import UNSEEN, library_terms
from backdrive_bayes.records.record import Unit

UNITS, LEVEL, AMPLITUDE, RATE, K = 40, 0.9, 0.1, 0.1, 0.03
NAMES = ("lost_motion_rad", "loop_area_J", "dissipation_ratio", "peak_angle_rad")
WIDER = student.ppf(0.95, module.POWER_DOF) / np.sqrt(module.POWER) / norm.ppf(0.95)
"""Width of 90 % intervals at the package's powers over that at the whole likelihood."""
LEAST, MOST = binom.interval(0.99, UNITS, LEVEL)


def fitted(unit: Unit, effects=(), seed=0, powers=module.POWERS):
    """A posterior of few blocks and few steps: log scales are drawn roughly, weights exactly, at the package's powers.

    The reducers are of the class, but not drawn from its prior; for those that are see studies/class_sbc.py.
    """
    return fitted_by(joint_mode(reduce_unit(unit, 30), effects), (), seed, powers)


def fitted_by(linear, hypothesis, seed=0, powers=module.POWERS):
    """The same about a mode."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "POWERS", powers)
        for room, name, value in (
            (sample, "WALKERS", 16),
            (sample, "FIRST_STEPS", 6),
            (sample, "MOST_STEPS", 6),
            (proposal, "BATCH", 48),
            (proposal, "EFFICIENT", 0.0),
        ):
            patch.setattr(room, name, value)
        return infer(linear, hypothesis, seed)


def truth_of(known, torque):
    angle = sum(p.cells.ends(settled_history(torque, RATE, AMPLITUDE)) @ known.weights[p.name] for p in known.reducer.parts)
    return core_indicators(cut_loops(torque, angle[None] * known.angle_scale_rad), K * AMPLITUDE)


@lru_cache(maxsize=1)
def drawn():
    """Draws of each indicator and its truth, for every unit."""
    found = []
    for seed in range(UNITS):
        known = random_reducer(np.random.default_rng(seed))
        unit = simulate_unit(known, [(AMPLITUDE, RATE)], BenchNoise(), np.random.default_rng(1000 + seed), 400.0)
        draws = IndicatorDraws(fitted(unit, seed=seed), K)
        truth = truth_of(known, draws.loops(RATE, AMPLITUDE).torque_nm)
        found.append({n: (draws.values(n, RATE, AMPLITUDE), truth[n][0]) for n in NAMES})
    return found


def covered(name, shrunk=1.0):
    """Units whose central interval holds the truth, the draws drawn together about their median by ``shrunk``."""
    hits = 0
    for unit in drawn():
        values, truth = unit[name]
        middle = np.median(values)
        lo, hi = np.quantile(middle + shrunk * (values - middle), [0.5 - LEVEL / 2, 0.5 + LEVEL / 2])
        hits += lo <= truth <= hi
    return hits


@pytest.mark.parametrize("name", NAMES)
def test_intervals_hold_the_truth_as_often_as_they_say(name):
    assert LEAST <= covered(name) <= MOST


def test_intervals_of_a_quarter_of_the_width_do_not():
    """A planted fault: the area and the peak show it at once."""
    assert min(covered("loop_area_J", 1 / 4), covered("peak_angle_rad", 1 / 4)) < LEAST - 3
    assert sum(covered(n, 1 / 4) for n in NAMES) < sum(covered(n) for n in NAMES) - 25


def test_intervals_are_narrow():
    """Coverage is cheap with wide intervals; few blocks tell little of the lost motion, and nothing
    before the first reversal."""
    for name, most in (("lost_motion_rad", 0.5), ("loop_area_J", 0.05), ("dissipation_ratio", 0.15), ("peak_angle_rad", 0.1)):
        widths = [np.diff(np.quantile(v, [0.05, 0.95]))[0] / abs(t) for v, t in (u[name] for u in drawn())]
        assert np.median(widths) < WIDER * most, (name, np.median(widths))


def ends(posterior):
    draws = IndicatorDraws(posterior, K)
    return {n: np.quantile(draws.values(n, RATE, AMPLITUDE), [0.05, 0.95]) for n in NAMES}


def test_the_last_bits_of_the_data_move_no_interval():
    """Times, torques and angles times 1 ± 1e-12: no end moves by more than a thousandth of the width."""
    unit, rng = planted(), np.random.default_rng(0)

    def shaken(values):
        return values * (1 + 1e-12 * rng.choice([-1.0, 1.0], values.size))

    records = tuple(replace(r, torque_nm=shaken(r.torque_nm), angle_rad=shaken(r.angle_rad)) for r in unit.records)
    here, there = (ends(fitted(u, library_terms())) for u in (unit, replace(unit, records=records)))
    for name in NAMES:
        assert np.abs(there[name] - here[name]).max() < 0.001 * np.diff(here[name])[0], name
    other = ends(fitted(planted(seed=1), library_terms()))
    assert any(np.abs(other[n] - here[n]).max() > 0.02 * np.diff(here[n])[0] for n in NAMES), "other noise must move them"


def test_a_coarsened_posterior_is_wider():
    unit = planted(loops=((0.1, 0.1),))
    full, third = (ends(fitted(unit, powers=(p,))) for p in (1.0, 1.0 / 3.0))
    assert all(np.diff(third[n])[0] > 1.3 * np.diff(full[n])[0] for n in NAMES)


@pytest.mark.parametrize(("loops", "term"), [(LOOPS, 1), (((0.05, 0.1), (0.1, 0.1)), 0)], ids=["amplitude", "rate"])
def test_loops_of_one_size_tell_nothing_of_how_thresholds_follow_it(loops, term):
    """Any reducer may have that law: a smaller loop, or one of another rate, is as uncertain as the law is a priori, one of the
    same size and rate is not. The planted fault takes the mean of the law for all there is."""
    linear = joint_mode(reduce_unit(planted(loops=loops), 30), library_terms())
    posterior, laws = fitted_by(linear, ()), {e.name: e for e in UNSEEN if e.term == term}
    assert len(laws) == 2 and not set(laws).intersection(linear.design.names) and set(laws) <= set(posterior.weights)
    assert {e.name for e in UNSEEN if e.term != term} <= set(linear.design.names)
    for name, law in laws.items():
        assert np.std(posterior.weights[name]) == pytest.approx(law.present(posterior.context), rel=0.1)
    without = replace(posterior, weights={n: w for n, w in posterior.weights.items() if n not in laws})

    def spread(which, amplitude, rate):
        torque = np.linspace(-amplitude, amplitude, 101)
        return np.std(cut_loops(torque, which.angles(settled_history(torque, rate, AMPLITUDE), rate)).width.mean(axis=1))

    away = (0.1 * AMPLITUDE, RATE) if term == 1 else (AMPLITUDE, 20.0 * RATE)
    assert spread(posterior, *away) > 2.0 * spread(without, *away)
    assert term == 0 or spread(posterior, *away) > 2.0 * spread(without, 0.2 * AMPLITUDE, RATE)
    assert spread(posterior, AMPLITUDE, RATE) == pytest.approx(spread(without, AMPLITUDE, RATE), rel=0.01)


def test_one_seed_gives_the_same_bytes():
    unit = planted(loops=((0.1, 0.1),))
    first, again, other = (fitted(unit, seed=s) for s in (5, 5, 6))
    assert all(first.weights[n].tobytes() == again.weights[n].tobytes() for n in first.weights)
    assert any(first.weights[n].tobytes() != other.weights[n].tobytes() for n in first.weights)
    assert first.convergence.evaluations == again.convergence.evaluations


@pytest.mark.parametrize("name, part", [("asymmetric_stiffness", "unequal_deflection"), ("torque_offset", "torque_offset")])
def test_draws_depart_from_their_mean_by_all_that_a_record_sees(name, part):
    """As the columns of the model say that was sampled; forms of one effect, and effects and class, stand against each other."""
    linear = prepared(name)[0]
    posterior = fitted_by(linear, (name,))
    away = {n: posterior.weights[n] - posterior.weights[n].mean(axis=(0, 1)) for n in linear.design.names}
    # What moves a parameter has the columns of the mean weights, which few draws hardly tell.
    posterior = replace(posterior, weights={n: w + linear.weights[n] for n, w in away.items()})
    flat = {n: w.reshape(-1, w.shape[-1]) for n, w in away.items()}
    by_name = {n: w @ linear.design.group(n).of_record(1).T * posterior.context.angle_scale_rad for n, w in flat.items()}
    right, found = sum(by_name.values()), predictive._departures(posterior)[1]
    assert np.std(found - right) < 0.005 * np.std(right)
    # Without one of them it would be seen.
    assert np.std(by_name[part]) > 0.2 * np.std(right)
