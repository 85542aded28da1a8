"""Compiled loops against plain numpy."""

import numpy as np
import pytest

from backdrive_bayes.model.bend import bent_line
from backdrive_bayes.model.gap import Steps, positions_in_gap
from backdrive_bayes.model.member import Drive
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.play import play


def test_tanh_is_exact_over_its_whole_range():
    x = np.concatenate([np.linspace(-30, 30, 4001), np.geomspace(1e-12, 1e3, 500)])
    found = bent_line(x, np.ones(1), np.zeros(1), np.ones(1))
    np.testing.assert_allclose(found, np.tanh(x), rtol=5e-15, atol=0)


@pytest.mark.parametrize("seed", range(4))
def test_gap_is_the_play_operator_between_its_boundaries(seed):
    rng = np.random.default_rng(seed)
    torque = np.concatenate([np.linspace(a, b, 40) for a, b in zip([0.1, 1, -0.7, 0.5], [1, -0.7, 0.5, -1], strict=True)])
    path, n = TorquePath.from_samples(torque), (5, 1)
    share, late = rng.uniform(0, 0.5, n), rng.uniform(0, 0.5, n)
    shares = ((1 - share) * (1 - late), (1 - share) * late, share)
    torques = (rng.uniform(0.05, 0.3, n), rng.uniform(0.3, 0.5, n), -0.01 * rng.uniform(0, 1, n))
    widths = tuple(rng.uniform(0.02, 0.2, (3, *n)))
    place, spread, shift = rng.uniform(0, 1, n), rng.uniform(0, 1, n), rng.uniform(-0.1, 0.1, n)

    def rising(t):
        return sum(s * np.tanh((t - d) / w) for s, d, w in zip(shares, torques, widths, strict=True))

    start = path.start_torque_nm - shift
    low, high = rising(start), -rising(-start)
    middle, below, above = (play(path, rising, state, shift) for state in (low + place * (high - low), low, high))
    expected = middle + spread * (below + place * (above - below) - middle)
    found = positions_in_gap(Drive(path, 1.0, shift_nm=shift), Steps(shares, torques, widths), place, spread)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)
    wider = Steps(shares, torques, (1.01 * widths[0], *widths[1:]))
    other = positions_in_gap(Drive(path, 1.0, shift_nm=shift), wider, place, spread)
    assert np.abs(other - expected).max() > 1e-4
