"""Fast structure: an encoder's error has one phase in all legs of a record, what a model leaves has not."""

from types import SimpleNamespace

import numpy as np
import pytest

from backdrive_bayes.gap.fast import _angle_periods, _sine_of_angle
from backdrive_bayes.gap.fine import FineLeg

NOISE, BLOCKS = 1e-5, 400
SETTING = SimpleNamespace(noise_rad=NOISE)


def legs(rng, amplitude, phases, cycles=20):
    """Three legs a record over ±0.02 rad with white noise and a sine of the angle of one phase a leg."""
    made = []
    for k, phase in enumerate(phases):
        angle = np.linspace(-0.02, 0.02, BLOCKS) * (-1) ** k
        error = amplitude * np.sin(2 * np.pi * cycles * angle / np.ptp(angle) + phase)
        residual = error / NOISE + rng.standard_normal(BLOCKS)
        way, lower = np.abs(angle - angle[0]), NOISE * np.eye(BLOCKS)
        made.append(FineLeg(k // 3, way, angle, np.arange(BLOCKS), (-1) ** k, lower, residual))
    return made


def evidence(made):
    return _sine_of_angle(SETTING, made, _angle_periods(made))


def test_one_phase_in_all_legs_of_a_record_is_found_with_its_period():
    found, period = evidence(legs(np.random.default_rng(1), 0.5 * NOISE, np.repeat([0.4, 2.5], 3)))
    assert found > 30 and abs(period / 2e-3 - 1) < 0.05


def test_short_periods_between_those_tried_are_found():
    found = [evidence(legs(np.random.default_rng(2), 0.5 * NOISE, np.repeat([0.4, 2.5], 3), n))[0] for n in (50.25, 60.25)]
    assert min(found) > 30


@pytest.mark.parametrize("seed", range(3))
def test_a_phase_of_each_leg_is_no_encoder(seed):
    rng = np.random.default_rng(seed)
    assert evidence(legs(rng, 0.5 * NOISE, rng.uniform(0, 2 * np.pi, 6)))[0] < 0


def test_noise_is_no_encoder():
    assert evidence(legs(np.random.default_rng(0), 0.0, np.zeros(6)))[0] < 3
