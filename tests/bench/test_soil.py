"""Traces of the channel effects: everywhere, of the height that is told, and below what can be told."""

import numpy as np
import pytest

from backdrive_bayes.bench.channel_noise import draw_noise
from backdrive_bayes.bench.plan import Loop, make_path
from backdrive_bayes.bench.protocol import Circumstances
from backdrive_bayes.bench.severity import height_of, make_yardstick
from backdrive_bayes.bench.sliders import MECHANICS
from backdrive_bayes.bench.soil import HEIGHT, TRACES, draw_soil


def yardstick(seed=0, rates=(0.5, 2.5)):
    rng = np.random.default_rng(seed)
    reducer = MECHANICS.draw_reducer(rng)
    records = [Circumstances(make_path(Loop(1.0, r), reducer.rated_torque_nm, ()), 50.0 * k, k) for k, r in enumerate(rates)]
    return make_yardstick(MECHANICS, reducer, records, draw_noise(rng, reducer))


@pytest.mark.parametrize("seed", range(3))
def test_every_channel_effect_is_there_in_a_trace_of_its_height(seed):
    measure = yardstick(seed)
    traces = draw_soil(np.random.default_rng(seed), measure, 1.0)
    assert tuple(t.name for t in traces) == TRACES
    for trace in traces:
        assert 0 < trace.height <= 1.25 * HEIGHT[1]
        assert measure.height(trace.effect) == pytest.approx(trace.height)
    together = measure.change([t.effect for t in traces]).reshape(2, -1)
    assert height_of(together - together.mean(axis=1, keepdims=True)) < 1.5


def test_what_can_be_absorbed_wholly_stays_small_too():
    measure = yardstick(rates=(0.5,))
    trace = {t.name: t for t in draw_soil(np.random.default_rng(0), measure, 1.0)}["rate_dependent_friction"]
    assert np.std(measure.change([trace.effect])) < 1.0


def test_soil_grows_with_its_level_and_spares_what_is_planted():
    measure = yardstick()
    usual, double = (draw_soil(np.random.default_rng(0), measure, level, ("sensor_lag",)) for level in (1.0, 2.0))
    assert "sensor_lag" not in {t.name for t in usual}
    assert sum(t.height for t in double) > 1.6 * sum(t.height for t in usual)
    assert draw_soil(np.random.default_rng(0), measure, 0.0) == ()
