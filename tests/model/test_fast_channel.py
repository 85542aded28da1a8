"""Effects that change within a block: what they add to block means, and where to look for an encoder's period."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import known_estimate, unit_of
from support.known import as_arrays, reducer, typical_values

from backdrive_bayes.bench.known_truth import BenchNoise
from backdrive_bayes.inference.problem import path_of
from backdrive_bayes.model.effects.encoder_error import EncoderError
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.registry import BASELINE
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.reduction import reduce_record

SILENT = BenchNoise(0.0, 0.0, 0.03, 0.0)
FAST = {
    "sensor_lag": {"lag_time": 0.012, "lag_low_pass_share": 0.4},
    "encoder_error": {
        "encoder_amplitude": 1e-4, "encoder_period": 2.5e-3, "encoder_harmonic": 0.3,
        "encoder_harmonic_phase": 0.2, "encoder_phase": 0.1,
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def blocks():
    """Blocks of a silent record with a steep step, 40 a leg, and the samples they are means of."""
    record = unit_of(noise=SILENT, release_width_ratio=0.1).records[0]
    found = reduce_record(record, find_segments(record.time_s, record.torque_nm), known_estimate(BenchNoise()), 40)
    return found, TorquePath.from_samples(record.torque_nm, record.time_s)


def added(name, path):
    """What the effect adds to the angle along a path."""
    model = reducer((*BASELINE, name))
    values = typical_values(model) | {"release_width_ratio": 0.1} | FAST[name]
    return model.parts(as_arrays(values), path)[name]


@pytest.mark.parametrize("name", FAST)
def test_what_is_added_to_block_means_is_the_mean_of_what_is_added_to_samples(blocks, name):
    found, samples = blocks
    starts = np.r_[0, np.cumsum(found.count)[:-1]]
    mean = np.add.reduceat(added(name, samples), starts) / found.count
    path = path_of(found)
    error, coarse = (np.std(added(name, p) - mean) for p in (path, replace(path, within=None)))
    assert error < 0.25 * np.std(mean)
    assert coarse > 2 * error


@pytest.mark.parametrize("name", FAST)
def test_parts_add_up_to_the_angle_of_blocks(blocks, name):
    model = reducer((*BASELINE, "thermal_drift", name))
    values = as_arrays(typical_values(model) | FAST[name])
    path = path_of(blocks[0])
    np.testing.assert_allclose(sum(model.parts(values, path).values()), model.angle(values, path), atol=1e-14)


def guessed_error(angle, record, residual):
    """Relative error of the best of the periods that are guessed, the true one being a thirtieth of the range."""

    def taken_out(columns):
        found = np.stack([np.linalg.lstsq(c.T, residual, rcond=None)[0] for c in columns])
        return found, np.einsum("sk,skb,b->s", found, columns, residual)

    guesses = EncoderError().guesses(angle, record, taken_out)
    return min(abs(g["encoder_period"] * 30 / np.ptp(angle) - 1) for g in guesses), guesses[0]


def test_the_period_of_an_encoder_is_guessed_though_each_record_has_its_phase():
    rng = np.random.default_rng(3)
    angle, record = np.concatenate([np.linspace(-1, 1, 200)] * 3), np.repeat(np.arange(3), 200)
    noise = rng.standard_normal(angle.size)
    phase = np.array([0.1, 0.5, 0.8])
    sine = np.sin(2 * np.pi * (angle * 30 / 2 + phase[record]))
    error, best = guessed_error(angle, record, sine + noise)
    assert error < 0.005
    np.testing.assert_allclose(np.exp(2j * np.pi * best["encoder_phase"]), np.exp(2j * np.pi * phase), atol=0.4)
    assert best["encoder_amplitude"] == pytest.approx(1.0, abs=0.2)
    assert guessed_error(angle, record, noise)[0] > 0.005
