"""Waves of the reading."""

from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.engine.periodic import HARMONICS, WAVE, rises, turns_back


@pytest.mark.parametrize(("height", "order", "rising"), [(0.01, 1, True), (0.05, 1, False), (0.05, 4, True), (0.2, 4, False)])
def test_a_reading_that_a_wave_turns_back_does_not_rise(height, order, rising):
    """Weights of a harmonic are those of its height times the square of its order; of two records with phases of their own one is
    enough. The slope of the angle plus its wave is the one that counts."""
    frequency, angle = 4.0, np.linspace(-1.0, 1.0, 4001)
    weights = np.zeros((2, HARMONICS, 2))
    weights[1, order - 1] = 0.6 * height, 0.8 * height
    slope = np.gradient(angle + height / order**2 * np.sin(2 * np.pi * frequency * order * angle + 0.3), angle)
    assert rises(SimpleNamespace(weights={WAVE: weights.ravel()}), frequency) is rising is bool(slope.min() > 0)
    own = weights / np.arange(1, HARMONICS + 1)[:, None] ** 2
    both = turns_back(np.stack([0.0 * own, own]).reshape(2, -1), np.array([frequency, frequency]))
    assert both.tolist() == [False, not rising]
