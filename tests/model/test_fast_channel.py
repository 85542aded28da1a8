"""Effects that change within a block: what they add to block means, and where to look for an encoder's period."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import known_estimate, unit_of
from support.known import as_arrays, reducer, typical_values

from backdrive_bayes.bench.known_truth import BenchNoise
from backdrive_bayes.gap.candidates import REFERENCE
from backdrive_bayes.gap.hypotheses import fit_none, screen
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.inference.problem import path_of
from backdrive_bayes.model.effects.encoder_error import EncoderError
from backdrive_bayes.model.path import TorquePath
from backdrive_bayes.model.registry import BASELINE, MEMBERS
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


def test_the_path_within_blocks_is_monotone_and_holds_the_blocks(rough):
    path = path_of(rough)
    within = path.within
    np.testing.assert_array_equal(within.torque_nm.reshape(path.torque_nm.size, -1)[:, 1], path.torque_nm)
    for leg, begin in zip(within.legs, rough.turning_nm, strict=False):
        way = leg.direction * within.torque_nm[leg.start : leg.stop]
        assert np.all(np.diff(way) >= 0)
        assert leg.direction * begin <= way[0] and way[-1] <= leg.direction * leg.end_torque_nm


@pytest.fixture(scope="module")
def rough():
    """Blocks of a record whose torque rises unevenly."""
    unit = unit_of(seed=3)
    record = unit.records[0]
    swing = 0.3e-3 * np.sin(2 * np.pi * record.time_s / 0.35) + 2e-3 * np.sin(2 * np.pi * record.time_s / 3.1)
    record = replace(record, torque_nm=record.torque_nm + swing)
    return reduce_record(record, find_segments(record.time_s, record.torque_nm), known_estimate(BenchNoise()), 40)


@pytest.mark.parametrize("beside", ["thermal_drift", "torque_offset", "viscoelastic_creep"])
@pytest.mark.parametrize("name", FAST)
def test_parts_add_up_to_the_angle_of_blocks(blocks, name, beside):
    model = reducer((*BASELINE, beside, name))
    values = as_arrays(typical_values(model) | FAST[name])
    path = path_of(blocks[0])
    # Creep relaxes along straight pieces of the load, which are others between nodes.
    near = 1e-6 if beside == "viscoelastic_creep" else 1e-14
    np.testing.assert_allclose(sum(model.parts(values, path).values()), model.angle(values, path), atol=near)


@pytest.mark.parametrize("beside", ["thermal_drift", "torque_offset"])
@pytest.mark.parametrize("name", FAST)
def test_a_fast_effect_of_no_size_leaves_the_angle_of_blocks_as_it_is(blocks, name, beside):
    model = reducer((*BASELINE, beside, name))
    values = typical_values(model) | FAST[name] | {p.name: 0.0 for p in MEMBERS[name].parameters if p.null == 0.0}
    path = path_of(blocks[0])
    without = reducer((*BASELINE, beside)).angle(as_arrays(values), path)
    np.testing.assert_allclose(model.angle(as_arrays(values), path), without, atol=1e-13)


PERIODS = 30.12


def guessed(angle, record, residual):
    """What the encoder error takes for promising, white noise and nothing else being known."""

    def taken_out(columns):
        found = np.stack([np.linalg.lstsq(c.T, residual, rcond=None)[0] for c in columns])
        return found, np.einsum("sk,skb,b->s", found, columns, residual)

    return EncoderError().guesses(angle, record, taken_out)


def test_the_period_of_an_encoder_is_guessed_though_each_record_has_its_phase():
    rng = np.random.default_rng(3)
    angle, record = np.concatenate([np.linspace(-1, 1, 200)] * 3), np.repeat(np.arange(3), 200)
    phase = np.array([0.1, 0.5, 0.8])
    sine = np.sin(2 * np.pi * (angle * PERIODS / 2 + phase[record]))
    best = guessed(angle, record, sine + rng.standard_normal(angle.size))[0]
    assert 2 / best["encoder_period"] == pytest.approx(PERIODS, abs=0.25)
    assert best["encoder_amplitude"] == pytest.approx(1.0, abs=0.2)
    np.testing.assert_allclose(np.exp(2j * np.pi * best["encoder_phase"]), np.exp(2j * np.pi * phase), atol=0.5)
    assert set(best) <= {p.name for p in EncoderError.parameters}
    # Phases swapped between records are not those.
    assert np.abs(np.exp(2j * np.pi * best["encoder_phase"][::-1]) - np.exp(2j * np.pi * phase)).max() > 1.0


def test_the_screen_starts_from_the_period_that_is_guessed():
    unit, phase = unit_of(seed=1, amplitudes=(0.1, 0.06)), np.array([0.2, 0.7])
    period = np.ptp(unit.records[0].angle_rad) / PERIODS
    records = tuple(
        replace(r, angle_rad=r.angle_rad + 2e-4 * np.sin(2 * np.pi * (r.angle_rad / period + p)))
        for r, p in zip(unit.records, phase, strict=True)
    )
    setting = Setting.of(replace(unit, records=records), np.random.default_rng(0), BASELINE)
    whitening = setting.whitening(REFERENCE)
    found = screen(setting, fit_none(setting, whitening), "encoder_error", whitening, np.random.default_rng(0))
    values = [found.problem.values(found.starts[0], r) for r in range(2)]
    assert values[0]["encoder_period"][0] == pytest.approx(period, rel=0.01)
    found = np.array([v["encoder_phase"][0] for v in values])
    # The encoder's zero moves both phases alike.
    np.testing.assert_allclose(np.exp(2j * np.pi * np.diff(found)), np.exp(2j * np.pi * np.diff(phase)), atol=0.5)
