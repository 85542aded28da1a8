"""How large effects may be as traces and where they act."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from support.planted import planted

from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.engine.traces import ABOVE, HEIGHT, trace_of, usual_of
from backdrive_bayes.mechanics.effect import GrowthEffect


@pytest.fixture(scope="module")
def linear():
    return prepare(planted(3, loops=((0.1, 0.1), (0.1, 0.01))))[0]


def moved(linear, effect):
    """Largest move of the angle by a trace, in standard deviations of the noise."""
    group = linear.design.groups[linear.design.names.index(effect.name)]
    found = []
    for column, slope, noise in zip(group.columns, linear.reduced.slopes(linear.predicted), linear.reduced.noise, strict=True):
        sd = np.hypot(noise.correlated_rad, slope * noise.torque_nm) / linear.reduced.angle_scale_rad
        found.append(np.abs(column).max(axis=1) / sd)
    return trace_of(linear, effect) * np.max(np.concatenate(found))


def test_a_trace_of_a_law_of_the_rate_moves_the_angle_by_a_part_of_its_noise(linear):
    for effect in linear.effects:
        if isinstance(effect, GrowthEffect) and trace_of(linear, effect) > effect.trace(linear.reduced.context):
            assert HEIGHT <= moved(linear, effect) < 5 * HEIGHT, effect.name


def test_what_acts_is_well_above_a_trace(linear):
    for effect in linear.effects:
        assert usual_of(linear, effect) >= ABOVE * trace_of(linear, effect)
    faint = next(e for e in linear.effects if e.name == "torque_offset")
    context = dataclasses.replace(linear.reduced.context, torque_noise=0.1)
    noisy = SimpleNamespace(reduced=SimpleNamespace(context=context))
    assert faint.trace(context) > faint.present(context), "the offset's own size says less than the noise of the torque"
    assert usual_of(noisy, faint) == pytest.approx(ABOVE * faint.trace(context))
