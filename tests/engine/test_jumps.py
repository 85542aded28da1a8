"""Leaps ahead are told from noise, and a stray leap back does not undo them."""

import numpy as np

from backdrive_bayes.engine.jumps import _mixture


def leaps(ahead=0, back=0):
    values = np.random.default_rng(0).standard_normal(2000)
    values[:ahead] = 12.0
    values[ahead : ahead + back] = -20.0
    return values


def factor(values):
    return _mixture(values) - _mixture(-values)


def test_many_leaps_ahead_speak_and_noise_does_not():
    assert factor(leaps(ahead=40)) > 100 and abs(factor(leaps())) < 3


def test_a_stray_leap_back_changes_little():
    assert factor(leaps(ahead=40, back=1)) > 0.9 * factor(leaps(ahead=40)) - 10


def test_leaps_of_either_sign_are_no_stick_slip():
    """A planted fault: as many back as ahead."""
    values = leaps(ahead=20)
    assert factor(values) > 50 and abs(factor(np.r_[values, -values])) < 1e-6
