"""Which measurement would best separate what is still confusable: the expected drop of entropy between the top two answers."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.gap.draws import laplace_draws
from backdrive_bayes.gap.hypotheses import Fitted
from backdrive_bayes.gap.setting import Setting, Whitening
from backdrive_bayes.inference.discrepancy import amplitude_nm
from backdrive_bayes.model.path import TorquePath

POINTS = 80
NODES = np.polynomial.hermite_e.hermegauss(41)


def propose(setting: Setting, pair: tuple[Fitted, Fitted], probability: tuple[float, float], whitening: Whitening, rng) -> dict:
    """The contract's ``next_test`` for the two hypotheses still most probable."""
    draws = [laplace_draws(f, whitening, rng)[:100] for f in pair]
    tests = {text: _drop(_separation(setting, pair, draws, path), probability) for text, path in _paths(setting).items()}
    if _in_channel(pair[0]) != _in_channel(pair[1]):
        text = "swap the sensor of the suspected channel for another and repeat the same record"
        tests[text] = _drop(_swap_separation(setting, pair, whitening), probability)
    best = max(tests, key=tests.get)
    names = ["+".join(f.effects) or "none" for f in pair]
    return {"do": best, "separates": names, "expected_entropy_drop_bits": float(tests[best]), "others": tests}


def _paths(setting):
    amplitude = max(amplitude_nm(setting.problem, r) for r in range(len(setting.problem.records)))
    rates = [setting.problem.loading_rate_nm_per_s(r) for r in range(len(setting.problem.records))]
    loop = amplitude * np.array([0, 1, -1, 1])
    slow, fast = 0.2 * min(rates), 5 * max(rates)
    return {
        f"repeat the loop at {slow:.3g} N·m/s": _path(loop, slow),
        f"repeat the loop at {fast:.3g} N·m/s": _path(loop, fast),
        "repeat the same record": _path(loop, float(np.median(rates))),
        f"measure the loop at half the amplitude, ±{0.5 * amplitude:.3g} N·m": _path(0.5 * loop, float(np.median(rates))),
        "load in the negative direction first": _path(-loop, float(np.median(rates))),
        "dwell for 30 s at each tip": _path(loop, float(np.median(rates)), dwell_s=30.0),
    }


def _path(turning, rate, dwell_s=0.0):
    base = TorquePath.from_turning_points(turning, POINTS, rate)
    time = base.time_s + dwell_s * np.concatenate([np.full(leg.stop - leg.start, k) for k, leg in enumerate(base.legs)])
    return TorquePath(base.torque_nm, time, base.start_torque_nm, base.legs)


def _separation(setting, pair, draws, path):
    """Squared distance of the two predictions in units of their own uncertainty and the noise."""
    curves = [f.problem.model.angle(f.problem.values(z, 0), path) for f, z in zip(pair, draws, strict=True)]
    curves = [c - c.mean(axis=1, keepdims=True) for c in curves]
    apart = curves[0].mean(axis=0) - curves[1].mean(axis=0)
    covariance = sum(np.cov(c.T) for c in curves) / 2 + (setting.noise_rad**2) * np.eye(path.torque_nm.size)
    return float(apart @ np.linalg.solve(covariance, apart))


def _swap_separation(setting, pair, whitening):
    channel = pair[0] if _in_channel(pair[0]) else pair[1]
    return float(sum((whitening.matrix @ c) @ (whitening.matrix @ c) for c in channel.contributions))


def _in_channel(fitted):
    stages = {m.name: m.stage for m in fitted.problem.model.members}
    return any(stages[name].channel for name in fitted.effects)


def _drop(separation, probability):
    """Expected entropy drop [bits] between two hypotheses whose predictions are ``separation`` apart, squared."""
    p = probability[0] / max(sum(probability), 1e-300)
    # Half the distance counts: formulas are approximate.
    distance = np.sqrt(min(0.5 * separation, 400.0))
    after = 0.0
    for truth, sign in ((p, 1.0), (1 - p, -1.0)):
        odds = np.log(max(p, 1e-12) / max(1 - p, 1e-12)) + sign * 0.5 * distance**2 + distance * NODES[0]
        after += truth * np.sum(NODES[1] * _entropy(1 / (1 + np.exp(-np.clip(odds, -60, 60))))) / np.sum(NODES[1])
    return max(_entropy(p) - after, 0.0)


def _entropy(p):
    p = np.clip(p, 1e-12, 1 - 1e-12)
    return -(p * np.log2(p) + (1 - p) * np.log2(1 - p))
