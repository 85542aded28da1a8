"""From log evidences to probabilities over {none, effects, pairs, unknown}.

Raw evidences are too sure of themselves, because every formula is approximate: they are divided by a temperature, and what the
baseline's misfit and unexplained structure are like beforehand is a prior over their levels. Temperature and priors were set
on simulated units of a virtual bench that shares no formula with the models (studies/diagnosis_calibration.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from backdrive_bayes.gap.candidates import MISFIT_LEVELS, Candidates
from backdrive_bayes.gap.fast import STICK_SLIP, VIBRATION, Fast
from backdrive_bayes.model.registry import BASELINE


@dataclass(frozen=True)
class Calibration:
    """Temperatures of slow and fast evidences, and relative prior weights.

    ``misfit`` follows ``MISFIT_LEVELS``, ``formula`` ``FORMULA_ERRORS``, ``unknown_level`` ``UNKNOWN_LEVELS``.

    The temperature of slow evidences rises from ``cool``, where nothing but noise is weighed, towards ``warm``, where formulas
    are approximate beyond the noise; it is halfway where ``halfway`` is gained, by the best hypothesis on the baseline or by
    unexplained structure beside a hypothesis. From what is unexplained ``slack`` is taken off, the share of what
    effects explain that counts as their formulas' error. ``unknown`` is the weight of something else and no effect,
    ``remainder`` of something else beside an effect, relative to that effect. ``imprint`` multiplies the temperature of slow
    evidences beside stick-slip, whose jumps leave traces in wide blocks that no slow model explains; ``beside`` is the share
    left to an effect beside fast structure, for two effects are rarer than the two of them apart would be, ``triple`` that left
    to three effects at once, or to fast structure with something unknown beside it. ``module`` are the odds of a module that
    every reducer has and the baseline was asked to do without, whatever else there is.
    """

    cool: float = 2.5
    warm: float = 13.0
    halfway: float = 40.0
    fast_temperature: float = 12.0
    none: float = 0.45
    single: float = 0.275
    pair: float = 0.025
    unknown: float = 0.25
    remainder: float = 1.0
    fast: float = 0.05
    imprint: float = 3.4
    beside: float = 0.3
    triple: float = 0.02
    module: float = 20.0
    slack: float = 0.1
    misfit: tuple[float, ...] = (0.76, 0.18, 0.04, 0.015, 0.005)
    formula: tuple[float, ...] = (0.85, 0.13, 0.02)
    unknown_level: tuple[float, ...] = (0.6, 0.25, 0.1, 0.05)


CALIBRATION = Calibration()
NONE, UNKNOWN = (), ("unknown",)
LARGE_MISFIT = 3.0
"""Misfit, in noise standard deviations, from which on something counts as unexplained in part."""


@dataclass(frozen=True, eq=False)
class Evidences:
    """Log evidences of one unit: by effects or, ``fast``, by name.

    ``slow`` has shape (misfit levels, formula errors), ``unexplained`` (kinds, levels, formula errors).
    """

    slow: dict[tuple[str, ...], np.ndarray]
    unexplained: dict[tuple[str, ...], np.ndarray]
    fast: dict[str, float]

    @classmethod
    def of(cls, candidates: Candidates, fast: Fast) -> Evidences:
        """From fitted hypotheses and fast structure."""
        slow = {tuple(sorted(w.effects)): w.log_evidence for w in candidates.weighed}
        unexplained = {tuple(sorted(effects)): values for effects, values in candidates.unexplained.items()}
        return cls(slow, unexplained, dict(fast.log_evidence))

    def as_json(self) -> dict:
        """Plain JSON data, to a hundredth of a nat."""
        slow, unexplained = ([[list(k), v.round(2).tolist()] for k, v in kept.items()] for kept in (self.slow, self.unexplained))
        return {"slow": slow, "unexplained": unexplained, "fast": self.fast}

    @classmethod
    def from_json(cls, kept: dict) -> Evidences:
        """What :meth:`as_json` gave."""
        slow, unexplained = ({tuple(k): np.array(v) for k, v in kept[part]} for part in ("slow", "unexplained"))
        return cls(slow, unexplained, kept["fast"])


def probabilities(evidences: Evidences, calibration: Calibration = CALIBRATION) -> dict[tuple[str, ...], float]:
    """Probability of every set of effects, () for none and ("unknown",) for something not in the library; they sum to one.

    Where something unknown acts beside an effect the whole is unknown, but a module that the baseline was left without stays
    named: (module, "unknown").
    """
    quick = _fast(evidences.fast, calibration)
    slow = {hot: _slow(evidences, calibration, hot) for hot in (1.0, calibration.imprint)}
    joint: dict[tuple[str, ...], float] = {}
    for name, q in quick.items():
        for effects, p in slow[calibration.imprint if name == STICK_SLIP else 1.0].items():
            both = _union(effects, name)
            joint[both] = joint.get(both, 0.0) + p * q * _share_beside(effects, name, both, calibration)
    total = sum(joint.values())
    if not np.isfinite(total):
        raise FloatingPointError("an evidence is not a number")
    return {effects: p / total for effects, p in joint.items()}


def _share_beside(effects, fast, both, c):
    """Prior share of slow ``effects`` beside fast structure, ``both`` together being what is answered."""
    number = sum(name not in BASELINE for name in both)
    if number > 2 or (effects[-1:] == UNKNOWN and fast not in (None, VIBRATION)):
        return c.triple
    return c.beside if both != effects and number == 2 else 1.0


def _union(effects, fast):
    if fast == VIBRATION or effects[-1:] == UNKNOWN:
        return _with_something_else(effects)
    return effects if fast is None or fast in effects else tuple(sorted((*effects, fast)))


def _with_something_else(effects):
    """What is answered where something unknown acts beside ``effects``."""
    return tuple(name for name in effects if name in BASELINE) + UNKNOWN


def _slow(evidences, c, hot):
    misfit, levels = (np.log(weights)[:, None] + np.log(c.formula) for weights in (c.misfit, c.unknown_level))
    weighed = np.array(list(evidences.slow.values())) + misfit
    value = dict(zip(evidences.slow, logsumexp(weighed, axis=(1, 2)), strict=True))
    gain = {effects: v - value[NONE] for effects, v in value.items()}
    most = max(gain.values())
    temperature = _temperature(c, most, hot)
    share = _prior([effects[0] for effects in evidences.slow if len(effects) == 1], c)
    score = {effects: np.log(share(effects)) + g / temperature for effects, g in gain.items()}
    strange: dict[tuple[str, ...], list[float]] = {}
    for effects, values in evidences.unexplained.items():
        more = logsumexp(values + levels) - np.log(len(values)) - value[effects]
        more -= c.slack * (most if effects == NONE else gain[effects])
        weight = c.unknown if effects == NONE else c.remainder * share(effects)
        told = np.log(weight) + gain[effects] / temperature + more / _temperature(c, abs(more), hot)
        strange.setdefault(_with_something_else(effects), []).append(told)
    # Where a hypothesis needs a misfit well beyond the noise, something is left that it does not explain.
    rough = logsumexp(weighed[:, np.array(MISFIT_LEVELS) >= LARGE_MISFIT], axis=(1, 2)) - value[NONE]
    for effects, rest in zip(evidences.slow, rough, strict=True):
        told = np.log(c.remainder * share(effects)) + (rest - c.slack * gain[effects]) / temperature
        strange.setdefault(_with_something_else(effects), []).append(told)
    return _normalised(score | {effects: logsumexp(told) for effects, told in strange.items()})


def lasting(evidences: Evidences, regained: float, calibration: Calibration = CALIBRATION) -> bool:
    """Whether an answer stands although a search still gained log posterior.

    It does where that shifts log odds by no more than one, or by half of what the answer is ahead of the next: other hypotheses
    might have gained as much.
    """
    value = {effects: values.max() for effects, values in evidences.slow.items()}
    first, second = list(marginal(probabilities(evidences, calibration)).values())[:2]
    ahead = np.log(first / max(second, 1e-300))
    return regained <= _temperature(calibration, max(value.values()) - value[NONE], 1.0) * max(1.0, 0.5 * ahead)


def _temperature(c, gain, hot):
    return hot * (c.cool + (c.warm - c.cool) * gain / (gain + c.halfway))


def _prior(names, c):
    """Prior weight of a set of effects, as a function of it: by how many they are, not counting modules held back."""
    others = sum(name not in BASELINE for name in names)
    shares = (c.none, c.single / max(others, 1), c.pair / max(others * (others - 1) / 2, 1))

    def share(effects):
        held_back = sum(name in BASELINE for name in effects)
        return shares[len(effects) - held_back] * c.module**held_back

    return share


def _fast(fast, c):
    score = {None: np.log(1 - c.fast)}
    for name, value in fast.items():
        score[name] = np.log(c.fast / len(fast)) + min(value, 1e4) / c.fast_temperature
    return _normalised(score)


def _normalised(score):
    total = logsumexp(list(score.values()))
    return {k: float(np.exp(v - total)) for k, v in score.items()}


def marginal(joint: dict[tuple[str, ...], float]) -> dict[str, float]:
    """Probability by label: single names, 'a+b' for pairs, 'unknown', 'none'; highest first.

    A module counts with and without something unknown beside it.
    """
    named: dict[str, float] = {}
    for effects, p in joint.items():
        label = "+".join(named_of(effects)) or "none"
        named[label] = named.get(label, 0.0) + p
    return dict(sorted(named.items(), key=lambda item: -item[1]))


def named_of(effects: tuple[str, ...]) -> tuple[str, ...]:
    """The names of an answer: what is unknown beside a named module is left out."""
    return effects[:-1] if len(effects) > 1 and effects[-1:] == UNKNOWN else effects


def unlisted(joint: dict[tuple[str, ...], float]) -> float:
    """Probability that something unknown acts, alone, instead of what is listed, or beside a named module."""
    return sum(p for effects, p in joint.items() if effects[-1:] == UNKNOWN)


def credible_set(labels: dict[str, float], level: float = 0.9) -> list[str]:
    """The fewest labels, most probable first, that hold ``level`` of the probability."""
    chosen, total = [], 0.0
    for label, p in sorted(labels.items(), key=lambda item: -item[1]):
        chosen.append(label)
        total += p
        if total >= level:
            break
    return chosen
