"""Flanks with friction in proportion to their load: found where one is planted, and not where none is."""

from dataclasses import replace

import numpy as np
import pytest
from support.planted import LOOPS, joint_mode, planted, smooth_reducer

from backdrive_bayes.bench.known_truth import BenchNoise
from backdrive_bayes.engine import search
from backdrive_bayes.engine.flanks import select_flank
from backdrive_bayes.engine.reduced import reduce_unit
from backdrive_bayes.mechanics.friction import flank
from backdrive_bayes.mechanics.reducer import ReducerClass
from backdrive_bayes.mechanics.registry import library_terms

RATIO, COMPLIANCE = 0.45, 0.5
"""The ratio lies halfway between two of the first grid."""
SMALLER = (*LOOPS, (0.06, 0.05))
QUIET = BenchNoise(white_rad=1e-5, correlated_rad=5e-6, torque_nm=1e-5)


def worm(known):
    """The reducer with a thread in series whose friction is in proportion to its load."""
    reducer = ReducerClass(known.reducer.knots, ratios=np.array([RATIO]))
    more = np.full(flank(RATIO)[0].count, COMPLIANCE)
    return replace(known, reducer=reducer, weights=known.weights | {"flanks": more})


@pytest.fixture(scope="module")
def without_flanks():
    """Modes of a unit with a worm and of one without, of a class that has no flanks yet."""
    plain, patch = smooth_reducer(), pytest.MonkeyPatch()
    patch.setattr(search, "MOST_FLANKS", 0)
    units = [planted(known=known, loops=SMALLER, noise=QUIET) for known in (plain, worm(plain))]
    found = [joint_mode(reduce_unit(unit), library_terms()) for unit in units]
    patch.undo()
    return found


def test_the_ratio_of_a_planted_flank_is_found(without_flanks):
    assert select_flank(without_flanks[1]) == pytest.approx([RATIO], abs=0.02)


def test_a_reducer_without_such_friction_has_no_flank(without_flanks):
    assert select_flank(without_flanks[0]).size == 0


def test_a_class_with_the_flank_holds_the_loops_better(without_flanks):
    linear = joint_mode(reduce_unit(without_flanks[1].reduced.unit), library_terms())
    assert np.abs(linear.reducer.ratios - RATIO).min() < 0.02
    assert linear.log_marginal > without_flanks[1].log_marginal + 20.0
