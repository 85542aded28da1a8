"""Friction of the class: what loops of one amplitude leave to its prior."""

import numpy as np
import pytest

from backdrive_bayes.engine.infer import prepare
from backdrive_bayes.indicators.indicators import loop_area_j
from backdrive_bayes.indicators.loop import cut_loops, settled_history, torque_grid
from backdrive_bayes.mechanics import friction
from backdrive_bayes.records.record import Record, Unit

RATES, AMPLITUDE = (0.01, 0.05, 0.1), 0.1
PLAYS = (0.01, 0.02, 0.04, 0.08, 0.12)
"""Thresholds in shares of the amplitude."""


def angle(torque, hardening=0.15):
    """Plays of small thresholds and a body that hardens towards its full load."""
    found = torque - hardening * torque**3
    for threshold in PLAYS:
        state = 0.0
        for i, value in enumerate(torque):
            state = min(max(state, value - threshold), value + threshold)
            found[i] += 0.1 * state
    return 3e-3 * found


def area(amplitude):
    """Of the settled loop [J]."""
    path = np.interp(np.linspace(0, 5, 20001), [0, 1, 3, 5], amplitude * np.array([0.0, 1.0, -1.0, 1.0]))
    turned = angle(path)[4000:]
    return abs(float(np.trapezoid(path[4000:], turned))) * AMPLITUDE


def unit():
    """Loops of one amplitude at three rates, with noise of a thousandth of their range."""
    rng, records = np.random.default_rng(0), []
    for rate in RATES:
        time = np.arange(0, 5 * AMPLITUDE / rate, AMPLITUDE / rate / 400)
        torque = np.interp(time * rate / AMPLITUDE, [0, 1, 3, 5], [0, 1, -1, 1])
        read = AMPLITUDE * (torque + 5e-4 * rng.standard_normal(time.size))
        turned = angle(torque) + 1.2e-5 * rng.standard_normal(time.size)
        records.append(Record(f"{rate}.csv", time, read, turned, rate, AMPLITUDE))
    return Unit("plays", AMPLITUDE, tuple(records))


def predicted(share):
    """Area of the settled loop of a share of the amplitude [J], at the mean weights."""
    linear = prepare(unit())[0]
    scale = linear.reduced.torque_scale_nm
    torque = torque_grid(share * AMPLITUDE, linear.reducer.knots * scale)
    ends = linear.reducer.ends(settled_history(torque, RATES[1], scale))
    turned = sum(columns @ linear.weights[name] for name, columns in ends.items())
    return float(loop_area_j(cut_loops(torque, turned[None] * linear.reduced.angle_scale_rad))[0])


@pytest.mark.parametrize("planted", [False, True])
def test_a_smaller_loop_than_was_measured_dissipates_less(planted, monkeypatch):
    """Planted fault: thresholds near full load are as usual as small ones. Then what hardens passes for friction that is taken
    back there, and a smaller loop dissipates as much as the larger one or more."""
    if planted:
        monkeypatch.setattr(friction, "LARGEST_THRESHOLD", np.inf)
        monkeypatch.setattr(friction, "masing", friction.masing.__wrapped__)
        monkeypatch.setattr("backdrive_bayes.mechanics.reducer.masing", friction.masing)
    assert area(0.8) < 0.8 * area(1.0)
    assert (predicted(0.8) < area(1.0)) is not planted
