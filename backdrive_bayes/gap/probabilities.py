"""From log Bayes factors to probabilities over {none, effects, pairs, unknown}.

Bayesian model comparison is too sure of itself where all models are slightly wrong. Log Bayes factors are divided by a
temperature that grows with what there is to explain (a coarsened posterior: Miller and Dunson, JASA 114, 2019), those of leaps in
the samples by one of their own. It is itself known to a factor of some e only, so that probabilities are averaged over it. The
numbers of :class:`Calibration` were set on labelled units of virtual benches, each scored while left out
(studies/diagnosis_calibration.py).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, log

import numpy as np
from scipy.special import gamma, logsumexp

from backdrive_bayes.gap.table import ENCODER, KINDS, UNEXPLAINED


@dataclass(frozen=True)
class Calibration:
    """Temperature ``cool`` + ``warm`` · √(largest log Bayes factor of its kind) at most, and log prior weights relative to none.

    ``single`` is that of one listed effect, ``second`` the further one of a second, ``wave`` the further one of an encoder error
    (any period may come by), ``unlisted`` that of something unlisted, ``beside`` its further one beside a listed effect.
    ``spread`` is that of the logarithm of the variance in noise units that a right hypothesis leaves. ``cover`` is what a
    90 % set must gather.
    """

    cool: float = 1.0
    warm: float = 1.89
    single: float = -3.36
    second: float = -3.58
    wave: float = -2.0
    unlisted: float = -1.9
    beside: float = -2.7
    spread: float = 0.355
    cover: float = 0.923


CALIBRATION = Calibration()
DOF = 4
"""Degrees of freedom of what is left: a noise level may be wrong by more than its usual error."""
T_HEIGHT = gamma((DOF + 1) / 2) / gamma(DOF / 2) / np.sqrt(np.pi * DOF)
TEMPERATURES = (1.0, np.exp(-1.0), np.exp(-2.0))
"""Shares of the highest temperature that are averaged over."""


def probabilities(
    log_factor: Mapping[tuple[str, ...], float],
    leaps: Mapping[tuple[str, ...], float],
    disturbance: float,
    left: Mapping[tuple[str, ...], float],
    properties: Mapping[str, float],
    calibration: Calibration = CALIBRATION,
) -> dict[tuple[str, ...], float]:
    """Probability of every set of effects, () for none; they sum to one.

    ``log_factor`` are log Bayes factors against none, of which ``leaps`` is what the samples say of leaps, where they are one of
    the effects, and the rest what the contrasts say: each has a temperature of its own. ``disturbance`` is that of a periodic
    disturbance in the samples, a kind of what is unlisted; one frequency in several records is no matter of any model, and is not
    coarsened. ``left`` is the variance of the contrasts in noise units that each set without something unlisted leaves,
    ``properties`` are the probabilities of effects inside the class, each taken alone.
    """
    slow = {effects: value - leaps.get(effects, 0.0) for effects, value in log_factor.items()}
    misfit = _misfits(leaps, left, calibration)
    hottest = np.array([_hottest(table.values(), calibration) for table in (slow, leaps)])
    heated = [np.maximum(hottest * share, 1.0) for share in TEMPERATURES]
    found = [_weights(slow, leaps, disturbance, misfit, temperatures, calibration) for temperatures in heated]
    joint = {h: float(sum(f[h] for f in found)) / len(found) for h in found[0]}
    for name, p in properties.items():
        joint = _beside(joint, name, p, calibration)
    total = sum(joint.values())
    if not np.isfinite(total):
        raise FloatingPointError("a log Bayes factor is not a number")
    return {h: w / total for h, w in joint.items()}


def _hottest(log_factors, calibration) -> float:
    """Highest temperature of what has these log Bayes factors."""
    return calibration.cool + calibration.warm * np.sqrt(max((0.0, *log_factors)))


@np.errstate(invalid="ignore")
def _weights(slow, leaps, disturbance, misfit, temperatures, calibration) -> dict[tuple[str, ...], float]:
    """Probability of every set of effects and of the same with something unlisted beside, without the operator's properties."""
    weight, least, temperature = {}, min(misfit.values()), temperatures[0]
    for effects, value in slow.items():
        if UNEXPLAINED in effects:
            continue
        prior = log_prior(effects, calibration) + leaps.get(effects, 0.0) / temperatures[1]
        weight[effects] = value / temperature + prior
        more = tuple(sorted((*effects, UNEXPLAINED)))
        # Something unlisted alone is due where no listed effect explains, not where none does.
        due = misfit[effects] if effects else least
        unlisted_prior = calibration.beside if effects else calibration.unlisted
        kinds = log(KINDS) + _of_kinds(slow.get(more, value), value, temperature), disturbance + value / temperature
        weight[more] = np.logaddexp(*kinds) - log(KINDS + 1) + prior + unlisted_prior + due
    value = np.array(list(weight.values()))
    return dict(zip(weight, np.exp(value - logsumexp(value)), strict=True))


def _of_kinds(log_factor, without, temperature) -> float:
    """Log weight of something unlisted, whose ``log_factor`` is the mean over its kinds: one of them stands out, the others
    explain as much as goes ``without``. Which one it is, is as likely before at every temperature (beside an encoder error two
    kinds fewer are weighed, which is left out of account)."""
    more = max(log_factor - without, 0.0)
    one = (more + log(KINDS - (KINDS - 1) * exp(-more))) / temperature
    return without / temperature + one + log(1.0 / KINDS + (1.0 - 1.0 / KINDS) * exp(-one))


def _misfits(leaps, left, calibration) -> dict[tuple[str, ...], float]:
    """Log Bayes factor of something unlisted beside each set of listed effects, from what the set leaves."""
    found = {effects: log_misfit(value, calibration.spread) for effects, value in left.items()}
    # Teeth that were found scatter the block means themselves: more than noise is due.
    return {effects: min(value, 0.0) if leaps.get(effects, 0.0) > 0.0 else value for effects, value in found.items()}


def log_misfit(left: float, spread: float) -> float:
    """Log Bayes factor of something unlisted from the variance in noise units that listed effects leave.

    Its logarithm is about zero where all is listed, Student-t of DOF with scale ``spread``. Something unlisted leaves that in one
    half of the cases and in the other more, exponential in the logarithm; beyond DOF + 1, where the ratio is largest, it stays.
    """
    excess = min(np.log(max(left, 1e-3)), DOF + 1.0)
    usual = -0.5 * (DOF + 1) * np.log1p((excess / spread) ** 2 / DOF) - np.log(spread / T_HEIGHT)
    return float(np.logaddexp(0.0, -excess - usual if excess > 0 else -np.inf)) - float(np.log(2.0))


def _beside(joint, name, probability, calibration):
    """Every set with and without a property of the operator, whose ``probability`` is that of a single effect: beside another its
    prior is that of a second one."""
    found: dict[tuple[str, ...], float] = {}
    odds = probability / (1.0 - probability)
    for effects, weight in joint.items():
        here = odds * np.exp(calibration.second - calibration.single) if effects else odds
        more = tuple(sorted((*effects, name)))
        found[effects] = found.get(effects, 0.0) + weight / (1.0 + here)
        found[more] = found.get(more, 0.0) + weight * here / (1.0 + here)
    return found


def log_prior(effects: tuple[str, ...], calibration: Calibration) -> float:
    """Log prior weight of a set of listed effects relative to none."""
    weight = calibration.single * bool(effects) + calibration.second * max(len(effects) - 1, 0)
    return weight + calibration.wave * (ENCODER in effects)


def labels(joint: Mapping[tuple[str, ...], float]) -> dict[str, float]:
    """Probabilities by the name of an answer, likeliest first: where something unlisted acts beside an effect, all is unknown."""
    found: dict[str, float] = {"none": 0.0, UNEXPLAINED: 0.0}
    for effects, p in joint.items():
        name = UNEXPLAINED if UNEXPLAINED in effects else "+".join(effects) or "none"
        found[name] = found.get(name, 0.0) + p
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def unlisted(joint: Mapping[tuple[str, ...], float]) -> float:
    """Probability that something acts which no listed effect explains."""
    return min(float(sum(p for effects, p in joint.items() if UNEXPLAINED in effects)), 1.0)


def credible_set(answers: Mapping[str, float], cover: float = CALIBRATION.cover) -> list[str]:
    """The fewest answers that gather the probability ``cover``."""
    chosen, gathered = [], 0.0
    for name, p in sorted(answers.items(), key=lambda item: -item[1]):
        chosen.append(name)
        gathered += p
        if gathered >= cover:
            break
    return chosen
