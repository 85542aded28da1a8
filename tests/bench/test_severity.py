"""Scaling of an effect to a height: found where there is one, the largest physical strength where there is not."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from backdrive_bayes.bench.protocol import BenchEffect
from backdrive_bayes.bench.severity import height_of, scale_to


@dataclass(frozen=True)
class Course:
    """A yardstick that knows only how height follows from strength."""

    law: object

    def height(self, effect):
        return self.law(effect.strength)


LAWS = [lambda s: 40 * s, lambda s: 1e4 * s, lambda s: 120 * s**2, lambda s: 100 * max(s - 0.1, 0.01 * s)]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("guess", [0.001, 0.1, 1.0])
@pytest.mark.parametrize("height", [0.5, 5.0, 12.0])
def test_a_height_is_met(law, guess, height):
    effect = BenchEffect()
    object.__setattr__(effect, "guess", guess)
    assert scale_to(effect, Course(law), height).strength == pytest.approx(_root(law, height), rel=0.1)


def _root(law, height):
    strengths = np.linspace(0, 1, 200001)
    return strengths[np.argmax([law(s) >= height for s in strengths])]


def test_what_is_limited_gets_its_largest_strength_and_no_height_none():
    assert scale_to(BenchEffect(), Course(lambda s: 3 * s), 10.0).strength == BenchEffect.most
    assert scale_to(replace(BenchEffect(), strength=0.3), Course(lambda s: 3 * s), 0.0).strength == 0.0


def test_a_short_bump_counts_as_its_height_and_nothing_as_nothing():
    z = np.zeros(1000)
    assert height_of(z) == 0.0
    z[10:30] = 5.0
    assert height_of(z) == pytest.approx(5.0)
