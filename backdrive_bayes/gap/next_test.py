"""Which measurement would best separate what is still confusable: the expected drop of entropy between the top two answers."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import effect_columns
from backdrive_bayes.gap.shrink import Fitted
from backdrive_bayes.mechanics.effect import GrowthEffect, TangentEffect
from backdrive_bayes.mechanics.history import History, through
from backdrive_bayes.number_text import plain

POINTS = 80
NODES = np.polynomial.hermite_e.hermegauss(41)
TIE = 0.02
"""Entropy [bits] within which proposals are equally good."""
AT_ODDS = 0.1
"""Noise of a prediction beside the measurement's: no formula is exact."""


def propose(pair: tuple[Fitted, Fitted], probability: tuple[float, float]) -> dict:
    """The contract's ``next_test`` for the two hypotheses that are still most probable."""
    drops, linear = {}, pair[0].linear
    for text, (history, rate) in _tests(linear).items():
        # Before the first tip the past decides, and no test separates what nobody knows.
        curves = [_predict(f, history, rate)[POINTS:] for f in pair]
        apart = curves[0] - curves[1]
        apart = apart - apart.mean()
        noise = linear.reduced.context.angle_noise
        drops[text] = _drop(float(apart @ apart) / (noise**2 + AT_ODDS * float(np.var(apart))) / 4.0, probability)
    best = max(drops.values())
    ties = [text for text, drop in drops.items() if drop > best - TIE]
    names = ["+".join(f.effects) or "none" for f in pair]
    return {"do": " or: ".join(ties[:3]), "separates": names, "expected_entropy_drop_bits": best, "others": drops}


def _tests(linear):
    scale, rates = linear.reduced.torque_scale_nm, linear.reduced.context.rate
    loop = np.array([0.0, 1.0, -1.0, 1.0])
    slow, fast, usual = 0.2 * rates.min(), 5.0 * rates.max(), float(np.median(rates))
    return {
        f"repeat the loop at {plain(slow * scale)} N·m/s": (_path(loop, slow), slow),
        f"repeat the loop at {plain(fast * scale)} N·m/s": (_path(loop, fast), fast),
        "repeat the same record": (_path(loop, usual), usual),
        f"measure the loop at half the amplitude, ±{plain(0.5 * scale)} N·m": (_path(0.5 * loop, usual), usual),
        "load in the negative direction first": (_path(-loop, usual), usual),
        "dwell for 30 s at each tip": (_path(loop, usual, 30.0), usual),
    }


def _path(turning, rate, dwell_s=0.0) -> History:
    legs = [np.linspace(a, b, POINTS) for a, b in zip(turning[:-1], turning[1:], strict=True)]
    if not dwell_s:
        legs = [*(leg[:-1] for leg in legs[:-1]), legs[-1]]
    torque, leg = np.concatenate(legs), np.repeat(np.arange(len(legs)), [leg.size for leg in legs])
    time = np.r_[0.0, np.cumsum(np.abs(np.diff(torque)))] / rate
    return through(time + dwell_s * leg, torque, 1.0)


def _predict(fitted: Fitted, history: History, rate: float) -> np.ndarray:
    """Angle at the segments' ends that a hypothesis expects, in shares of the angle scale."""
    linear = fitted.linear
    weights, context = linear.design.split(fitted.mean), linear.reduced.context
    log_rate = np.log(rate) - np.log(context.rate).mean() + history.surge
    growth = linear.distortion.growth(log_rate, history.log_amplitude, context)
    base = linear.reducer.ends(history, growth)
    mean = {n: weights[n] for n in base}
    turned = angle = sum(base[n] @ mean[n] for n in base)
    step, direction = np.abs(history.z1 - history.z0), np.sign(history.z1 - history.z0)
    slope = np.where(step > 1e-9, np.diff(angle, prepend=angle[0]) / np.maximum(step, 1e-9), 0.0)
    for effect in linear.effects:
        weight = weights.get(effect.name)
        if weight is None:
            continue
        columns = effect_columns(effect, linear.reducer, history, mean, growth, turned, context, ends=True)
        if columns is not None:
            angle = angle + columns @ weight[: columns.shape[1]]
        elif isinstance(effect, GrowthEffect):
            term = linear.distortion.law(log_rate, history.log_amplitude, context)[effect.term]
            away = weight[:1] - getattr(linear.distortion, effect.parameter)
            angle = angle + linear.reducer.shifted(history, mean, growth, effect.part, away, term)[0]
        elif isinstance(effect, TangentEffect):
            # The path itself is free of offset and lag: their whole size counts.
            angle = angle + float(weight[0]) * {"offset": direction * slope, "lag_s": -rate * slope}[effect.parameter]
    return angle


def _drop(separation, probability):
    """Expected entropy drop [bits] between two hypotheses whose predictions are ``separation`` apart, squared."""
    p = probability[0] / max(sum(probability), 1e-300)
    distance = np.sqrt(min(separation, 400.0))
    after = 0.0
    for truth, sign in ((p, 1.0), (1 - p, -1.0)):
        odds = np.log(max(p, 1e-12) / max(1 - p, 1e-12)) + sign * 0.5 * distance**2 + distance * NODES[0]
        after += truth * np.sum(NODES[1] * _entropy(1 / (1 + np.exp(-np.clip(odds, -60, 60))))) / np.sum(NODES[1])
    return float(max(_entropy(p) - after, 0.0))


def _entropy(p):
    p = np.clip(p, 1e-12, 1 - 1e-12)
    return -(p * np.log2(p) + (1 - p) * np.log2(1 - p))
