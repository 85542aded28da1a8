"""Model discrepancy: absent on noise, found where it is planted, and never at the parameters' expense."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench import KNOWN_NOISE, unit_of
from support.known import RATED, SCALE, as_arrays, reducer, settled_loops, typical_values

from backdrive_bayes.bench.known_truth import ramp
from backdrive_bayes.indicators.indicators import loop_area_j
from backdrive_bayes.indicators.loop import Loops, model_loops
from backdrive_bayes.indicators.summary import core_indicators, reducer_loops
from backdrive_bayes.inference import discrepancy
from backdrive_bayes.inference.discrepancy import angle_jacobian, learn_discrepancy
from backdrive_bayes.inference.fit import prepare

RATE, K, MISFIT_RAD = 0.05, 0.03, 4e-4


def misfit(torque, direction):
    """An even wave, which no odd module can follow, and one of opposite sign on the two branches, in rad."""
    return MISFIT_RAD * (
        np.cos(2 * np.pi * torque / RATED) + 0.5 * direction * np.sin(np.pi * torque / RATED)
    )


def spoilt_unit(seed):
    """A simulated unit whose angle no set of parameters explains."""
    unit = unit_of(seed, rate=RATE)
    record, torque = unit.records[0], ramp(RATED, RATE)[1]
    direction = np.sign(np.gradient(torque))
    return replace(unit, records=(replace(record, angle_rad=record.angle_rad + misfit(torque, direction)),))


@pytest.fixture(scope="module", params=[0, 1, 2], ids=lambda s: f"seed {s}")
def spoilt(request):
    prepared = prepare(spoilt_unit(request.param), np.random.default_rng(0), scale=SCALE)
    rng, d = np.random.default_rng(1), prepared.discrepancy
    z = rng.multivariate_normal(prepared.optimum.z, prepared.optimum.covariance, 400)
    return prepared, z, d.draw(prepared.problem, z, rng)


def true_loops(torque):
    loops = settled_loops(reducer(), as_arrays(typical_values(reducer())), torque)
    return Loops(torque, loops.rising + misfit(torque, 1), loops.falling + misfit(torque, -1))


def centred(loops):
    both = np.concatenate([loops.rising, loops.falling], axis=1)
    return both - both.mean(axis=1, keepdims=True)


def band_share(loops):
    """Share of the loop's points whose 90 % band holds the true curve."""
    lo, hi = np.quantile(centred(loops), [0.05, 0.95], axis=0)
    true = centred(true_loops(loops.torque_nm))[0]
    return np.mean((lo <= true) & (true <= hi))


@pytest.mark.parametrize("seed", range(3))
def test_noise_is_no_discrepancy(seed):
    found = prepare(unit_of(seed, rate=RATE), np.random.default_rng(0), scale=SCALE).discrepancy
    assert found.gain < 4
    assert found.scale_rad < 0.5 * KNOWN_NOISE.correlated_rad


def test_planted_misfit_is_seen(spoilt):
    found = spoilt[0].discrepancy
    assert found.present and found.gain > 20
    assert 0.2 * MISFIT_RAD < found.scale_rad < 5 * MISFIT_RAD


def test_planted_misfit_is_recovered_within_its_band(spoilt):
    prepared, z, weights = spoilt
    full = reducer_loops(prepared.problem, prepared.discrepancy, z, weights, 0, K)
    bare = model_loops(prepared.problem, z, 0, full.torque_nm)
    assert band_share(full) > 0.75
    assert band_share(bare) < 0.5, "without the discrepancy the bands must miss the true curve"
    true = centred(true_loops(full.torque_nm))[0]
    far = np.abs(centred(bare).mean(axis=0) - true).max()
    assert np.abs(centred(full).mean(axis=0) - true).max() < 0.5 * far


def test_intervals_of_the_area_stay_true(spoilt):
    prepared, z, weights = spoilt
    loops = reducer_loops(prepared.problem, prepared.discrepancy, z, weights, 0, K)
    true = float(loop_area_j(true_loops(loops.torque_nm))[0])
    area = loop_area_j(loops)
    assert abs(true - area.mean()) < 3.5 * area.std()


def alignment(jacobian, basis, strong=1000.0):
    """Largest share of any term that lies in the parameters' well-measured directions."""
    left, size, _ = np.linalg.svd(jacobian, full_matrices=False)
    left = left[:, size**2 > strong]
    return (np.linalg.norm(left.T @ basis, axis=0) / np.linalg.norm(basis, axis=0)).max()


def test_basis_is_orthogonal_to_the_parameters(spoilt):
    prepared = spoilt[0]
    problem, d = prepared.problem, prepared.discrepancy
    data = problem.records[0]
    jacobian = data.whitener @ angle_jacobian(problem, d.optimum.z, 0, data.path)
    np.testing.assert_allclose(jacobian, -d.optimum.jacobian, atol=1e-4 * np.abs(jacobian).max())
    assert alignment(jacobian, data.whitener @ d.basis_on(problem, 0, data.path, first_leg=True)) < 0.02
    assert alignment(jacobian, data.whitener @ d.raw_basis(0, data.path)) > 0.3, (
        "the raw basis must fail this check"
    )


def test_absent_discrepancy_draws_nothing(spoilt):
    prepared = spoilt[0]
    none = replace(prepared.discrepancy, scale_rad=0.0)
    assert not none.present
    assert not none.draw(prepared.problem, prepared.optimum.z[None], np.random.default_rng(0)).any()


def tip_miss(cusp_share, monkeypatch):
    """How far the peak angle's median lies from the truth, in standard deviations, for smooth misfit with sharp tips."""
    monkeypatch.setattr(discrepancy, "CUSP_SHARE", cusp_share)
    unit, torque = unit_of(1, rate=RATE), ramp(RATED, RATE)[1]
    # Zero at both tips but for an even part, which leaves the peak as it is.
    smooth = 5 * misfit(torque, np.sign(np.gradient(torque)))
    sharp = 3 * MISFIT_RAD * np.sign(torque) * np.exp(-(RATED - np.abs(torque)) / (0.1 * RATED))
    record = replace(unit.records[0], angle_rad=unit.records[0].angle_rad + smooth + sharp)
    prepared = prepare(replace(unit, records=(record,)), np.random.default_rng(0), scale=SCALE)
    rng, d = np.random.default_rng(1), prepared.discrepancy
    z = rng.multivariate_normal(prepared.optimum.z, prepared.optimum.covariance, 400)
    loops = reducer_loops(prepared.problem, d, z, d.draw(prepared.problem, z, rng), 0, K)
    peak = core_indicators(loops, K * RATED)["peak_angle_rad"]
    plain = core_indicators(settled_loops(reducer(), as_arrays(typical_values(reducer())), loops.torque_nm), K * RATED)
    return abs(np.median(peak) - plain["peak_angle_rad"][0] - 3 * MISFIT_RAD) / np.std(peak)


def test_a_cusp_at_the_tips_is_followed(monkeypatch):
    assert tip_miss(discrepancy.CUSP_SHARE, monkeypatch) < 2.5
    assert tip_miss(1e-6, monkeypatch) > 2.5


def test_learning_is_deterministic(spoilt):
    prepared = spoilt[0]
    bare = replace(prepared.problem)
    once, again = (learn_discrepancy(bare, prepared.discrepancy.optimum) for _ in range(2))
    assert (once.scale_rad, once.length, once.gain) == (again.scale_rad, again.length, again.gain)
    assert np.array_equal(once.factor, again.factor)
