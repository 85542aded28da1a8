"""Which measurement would best separate what is still confusable: the expected drop of entropy between the top two answers."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from backdrive_bayes.engine.design import effect_columns
from backdrive_bayes.gap.shrink import Fitted
from backdrive_bayes.mechanics.effect import GrowthEffect, TangentEffect
from backdrive_bayes.mechanics.history import History, through
from backdrive_bayes.mechanics.registry import all_effects
from backdrive_bayes.number_text import plain

POINTS = 80
NODES = np.polynomial.hermite_e.hermegauss(41)
TIE = 0.02
"""Entropy [bits] within which proposals are equally good."""
BY_CHANCE = 1.0
"""Log odds that informative records may still leave between two answers: evidence scatters by about as much as it is."""
AGAIN = "repeat the same record"


def propose(pair: tuple[Fitted, Fitted], probability: tuple[float, float]) -> dict | None:
    """The contract's ``next_test`` for the two hypotheses that are still most probable; None where none would tell."""
    linear, separations = pair[0].linear, {}
    noise = linear.reduced.context.angle_noise
    for text, (history, rate) in _tests(linear).items():
        # Before the first tip the past decides, and no test separates what nobody knows; nor does anybody know the zero.
        one, other = (_predict(fitted, history, rate)[:, POINTS:] for fitted in pair)
        separations[text] = _separation(one - one.mean(axis=1, keepdims=True), other - other.mean(axis=1, keepdims=True), noise)
    # One more of the records that were measured separates no better than these did: no formula is exact, noise is correlated.
    known = 2.0 * max(abs(float(np.log(probability[0] / probability[1]))), BY_CHANCE) / len(linear.angles)
    share = min(1.0, known / max(separations[AGAIN], 1e-300))
    drops = {text: _drop(share * separation, probability) for text, separation in separations.items()}
    best = max(drops.values())
    if best < TIE:  # as good as none
        return None
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
        AGAIN: (_path(loop, usual), usual),
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
    """Angles at the segments' ends in shares of the angle scale, (1 + directions, segments): what a hypothesis expects, and a
    standard deviation away from it in independent directions of its weights, those that the records leave open among them."""
    linear = fitted.linear
    directions = np.c_[fitted.mean, fitted.mean[:, None] + fitted.root]
    weights, scale, context = linear.design.split(directions), linear.design.split(fitted.scale), linear.reduced.context
    own, spread = {g.name for g in linear.design.groups if g.own}, list[np.ndarray]()
    log_rate = np.log(rate) - np.log(context.rate).mean() + history.surge
    growth = linear.distortion.growth(log_rate, history.log_amplitude, context)
    law = linear.distortion.law(log_rate, history.log_amplitude, context)
    base = linear.reducer.ends(history, growth)
    mean = {n: weights[n][:, 0] for n in base}
    angle = sum(base[n] @ weights[n] for n in base).T
    turned = angle[0].copy()
    step, direction = np.abs(history.z1 - history.z0), np.sign(history.z1 - history.z0)
    slope = np.where(step > 1e-9, np.diff(turned, prepend=turned[0]) / np.maximum(step, 1e-9), 0.0)
    for effect in linear.effects:
        weight = weights.get(effect.name)
        if weight is None:
            continue
        columns = effect_columns(effect, linear.reducer, history, mean, growth, turned, context, ends=True)
        if columns is not None and effect.name in own:
            # Each record has weights of its own: of another one nothing is known but how large they may be.
            spread.append((columns * scale[effect.name][: columns.shape[1]]).T)
        elif columns is not None:
            angle = angle + (columns @ weight).T
        elif isinstance(effect, GrowthEffect):
            further = weight[0] - getattr(linear.distortion, effect.parameter)
            angle = angle + linear.reducer.shifted(history, mean, growth, effect.part, further, law[effect.term])
        elif isinstance(effect, TangentEffect):
            # The path itself is free of offset and lag: their whole size counts.
            angle = angle + weight[0][:, None] * {"offset": direction * slope, "lag_s": -rate * slope}[effect.parameter]
    terms = (e for name in fitted.effects for e in all_effects().get(name, ()) if isinstance(e, GrowthEffect))
    unlearnt = ((e, np.array([e.present(context)])) for e in terms if e.name not in weights)
    spread += [linear.reducer.shifted(history, mean, growth, e.part, sd, law[e.term]) for e, sd in unlearnt]
    return np.concatenate([angle, *(angle[:1] + away for away in spread)])


def _separation(one, other, noise) -> float:
    """Twice the Kullback-Leibler divergence of two Gaussian predictions as from ``_predict``, in nats: the smaller of the two, as
    either may hold. Of two that scatter alike it is the square of their distance in standard deviations."""
    away, scatter = one[0] - other[0], [curves[1:] - curves[0] for curves in (one, other)]
    covariances = [noise**2 * np.eye(away.size) + s.T @ s for s in scatter]
    factors = [cho_factor(c) for c in covariances]
    volumes = [2.0 * float(np.sum(np.log(np.diag(factor)))) for factor, _ in factors]

    def twice(true, model):
        stretched = float(np.trace(cho_solve(factors[model], covariances[true])))
        return stretched - away.size + volumes[model] - volumes[true] + float(away @ cho_solve(factors[model], away))

    return max(min(twice(0, 1), twice(1, 0)), 0.0)


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
