"""The whole diagnosis of one unit, from its records to the contract's diagnosis.json."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.parameters import PARAMETERS, posterior_parameters
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.gap import next_test, probabilities, where
from backdrive_bayes.gap.averaged import posterior_of, weighed_unit, with_columns
from backdrive_bayes.gap.hypotheses import ENCODER, STICK_SLIP, Weighed
from backdrive_bayes.gap.parameters import effect_parameters, interval
from backdrive_bayes.gap.properties import Property, find_properties
from backdrive_bayes.gap.shrink import Fitted, fit_hypothesis, shrink
from backdrive_bayes.indicators.draws import IndicatorDraws
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import all_effects
from backdrive_bayes.records.check import check_unit
from backdrive_bayes.records.record import Unit
from backdrive_bayes.results import DIAGNOSIS

LEVEL = 0.9
LEAST_CLOSED = 0.5
"""A name that closes less of the gap than this on held-out data, with all of its interval below, is unknown."""
MODULE_ODDS = 3.0
"""Log odds of a module that every reducer has and the baseline was asked to do without."""
SHOWN = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found: the contract's object, the effects of the chosen model, its posterior, which is the one that was
    computed, and the weighed unit that it rests on."""

    json: dict
    effects: tuple[str, ...]
    posterior: Posterior
    weighed: Weighed


def diagnose(
    unit: Unit,
    *,
    baseline=BASELINE,
    seed: int = 0,
    allowed=None,
    k: float = 0.03,
    progress: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """Where model and measurement part, which effect causes it, how far the gap shrinks with it.

    ``allowed`` names the effects of the library (default: all). BadInput where the unit cannot be read as a test.
    """
    with one_thread():
        return _diagnose(unit, tuple(baseline), seed, allowed, k, progress)


def _diagnose(unit, baseline, seed, allowed, k, progress):
    rng = np.random.default_rng(seed)
    weighed = weighed_unit(unit, BASELINE, allowed, progress)
    withheld = _withheld(weighed.linear, baseline)
    properties = tuple(p for p in find_properties(weighed, rng) if allowed is None or p.name in allowed)
    joint = probabilities.probabilities(weighed.log_factor, weighed.left, {p.name: p.probability for p in properties})
    joint = _with_modules(joint, withheld)
    progress("where it lies and how far it shrinks")
    found = _Found(unit, weighed, properties, joint, withheld, rng, k, baseline, allowed, seed)
    return found.finish(progress)


def _withheld(linear: Linear, baseline) -> dict[str, float]:
    """Probability of each module that the baseline lacks, from the log marginal likelihood with and without it."""
    found = {}
    for module in BASELINE:
        if module not in baseline:
            names = {p.name for p in linear.reducer.parts if p.module == module} | (
                {"floating"} if module == "geometric" else {"initial"}
            )
            scale = np.exp([linear.log_scale[n] for n in linear.design.names])
            without = np.where(np.isin(linear.design.names, list(names)), 1e-6, scale)
            gain = linear.data.log_marginal(scale[linear.design.index]) - linear.data.log_marginal(without[linear.design.index])
            found[module] = float(expit(gain / 10.0 + MODULE_ODDS))
    return found


def _with_modules(joint, withheld):
    for module, p in withheld.items():
        both = {}
        for h, w in joint.items():
            both[h] = both.get(h, 0.0) + w * (1 - p)
            both[tuple(sorted((*h, module)))] = w * p
        joint = both
    return joint


@dataclass(frozen=True, eq=False)
class _Found:
    unit: Unit
    weighed: Weighed
    properties: tuple[Property, ...]
    joint: dict
    withheld: dict
    rng: np.random.Generator
    k: float
    baseline: tuple
    allowed: tuple | None
    seed: int

    @property
    def linear(self) -> Linear:
        return self.weighed.of(())

    def finish(self, progress) -> Diagnosis:
        answers = self._labels()
        likeliest = next(iter(answers))
        effects = () if likeliest == "none" else tuple(likeliest.split("+"))
        gap = where.estimate_gap(self.linear, self.rng)
        # A process of each leg's own fits what is held out by itself: something unknown closes nothing.
        before, after = self._fitted(()), self._fitted(tuple(e for e in effects if e != "unknown"))
        shrunk = shrink(before, after, gap.weight, self.rng)
        closed = self._closed(effects, shrunk)
        named = effects
        if self._hollow(effects, closed):
            answers = _doubted(answers, likeliest)
            effects = ("unknown",)
        inconclusive = _why_inconclusive(self.unit)
        listed = tuple(e for e in effects if e in all_effects())
        progress("sampling the chosen model")
        posterior = posterior_of(self.weighed, effects, self.seed, progress)
        none = posterior_of(self.weighed, (), self.seed, progress) if effects else posterior
        json = {
            "schema": DIAGNOSIS,
            "unit": self.unit.name,
            "baseline": list(self.baseline),
            "level": LEVEL,
            "k": self.k,
            "inconclusive": inconclusive,
            "records": self._records(),
            "gap": {
                "probability": float(1 - answers.get("none", 0.0)),
                "unlisted_probability": probabilities.unlisted(self.joint),
                "rms_rad": gap.rms_rad,
                "noise_floor_rad": gap.noise_rad,
            },
            "where": self._where(gap),
            "which": self._which(answers, effects, posterior),
            "answer": {"effects": [] if inconclusive else list(effects), "credible_set_90": probabilities.credible_set(answers)},
            "shrink": self._shrink(shrunk, named, closed, none, posterior),
            "next_test": self._next_test(answers),
            "parameter_shift": _shifts(none, posterior),
            "residual": self._residual(before, after),
            "convergence": posterior.convergence.to_json(),
        }
        return Diagnosis(json, listed, posterior, self.weighed)

    def _labels(self):
        modules = set(self.withheld)
        found: dict[str, float] = {"none": 0.0, "unknown": 0.0}
        for effects, p in self.joint.items():
            named = [e for e in effects if e in modules]
            # A module stays named where something unlisted acts beside it.
            rest = (
                []
                if "unknown" in effects and named
                else ["unknown"]
                if "unknown" in effects
                else [e for e in effects if e not in modules]
            )
            name = "+".join([*named, *rest]) or "none"
            found[name] = found.get(name, 0.0) + p
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def _fitted(self, effects) -> Fitted:
        """A hypothesis in the linear model; what has no columns of its own stands for itself by those of the class."""
        linear = with_columns(self.weighed, effects)
        priors = levels(linear, tuple(effects))
        for module in self.withheld:
            if module not in effects:
                for part in linear.reducer.parts:
                    if part.module == module:
                        priors[part.name] = (-14.0, 0.0)
        return fit_hypothesis(linear, effects, priors)

    def _hollow(self, effects, closed) -> bool:
        """Whether a name explains too little of held-out data to be one."""
        names = set(effects) - {p.name for p in self.properties} - {STICK_SLIP, "unknown", *self.withheld}
        gap = probabilities.log_misfit(self.weighed.left[()], probabilities.CALIBRATION.spread) > 0
        return bool(names) and gap and closed is not None and closed["hi"] < LEAST_CLOSED

    def _closed(self, effects, shrunk, fold=None) -> dict | None:
        """Closed fraction of one fold or of all; None where only properties are named: the class holds them before and after."""
        if effects and set(effects) <= {p.name for p in self.properties}:
            return None
        return shrunk.closed("after", self.rng, LEVEL, fold)

    def _records(self):
        reduced = self.linear.reduced
        rate = reduced.context.rate * reduced.torque_scale_nm
        return [
            {"file": b.name, "loading_rate_Nm_per_s": float(v), "amplitude_Nm": float(np.abs(b.turning_nm).max())}
            for b, v in zip(reduced.blocks, rate, strict=True)
        ]

    def _where(self, gap):
        cells = where.gap_map(self.linear, gap)
        amplitudes = {row["file"]: row["amplitude_Nm"] for row in self._records()}
        return {"summary": where.summary(cells, amplitudes), "map": cells}

    def _which(self, answers, effects, posterior):
        names = [*all_effects(), ENCODER, STICK_SLIP, *(p.name for p in self.properties), *self.withheld]
        listed = {n: 0.0 for n in names if self.allowed is None or n in self.allowed or n in self.withheld}
        rows = []
        for label, p in sorted((listed | {"unknown": 0.0, "none": 0.0} | answers).items(), key=lambda item: -item[1]):
            found = {}
            for name in label.split("+"):
                if name in effects:
                    found |= effect_parameters(self.weighed, self.properties, posterior, name, LEVEL)
            rows.append({"effect": label, "probability": float(p)} | ({"parameters": found} if found else {}))
        return rows

    def _shrink(self, shrunk, named, closed, none, posterior):
        widest = int(np.argmax(posterior.records.amplitude_nm))
        change = {}
        for key, drawn in (("before", none), ("after", posterior)):
            loop = IndicatorDraws(drawn, self.k), drawn.records.rate_nm_per_s[widest], drawn.records.amplitude_nm[widest]
            for name in SHOWN:
                values = loop[0].values(name, *loop[1:])
                change.setdefault(name, {})[key] = interval(values, LEVEL) if np.isfinite(values).all() else None
        return {
            "held_out": "records left out in turn" if len(posterior.records.names) > 1 else "legs left out in turn",
            **_rms(shrunk),
            "closed_fraction": closed,
            "records": [
                {"record": name, **_rms(shrunk, fold), "closed_fraction": self._closed(named, shrunk, fold)}
                for fold, name in enumerate(shrunk.names)
            ],
            "indicators_at": self._records()[widest],
            "gaussian_process": {"closed_fraction": shrunk.closed("control", self.rng, LEVEL)},
            "indicators": change,
        }

    def _next_test(self, answers):
        usable = [(n, p) for n, p in answers.items() if n != "unknown"][:2]
        if len(usable) < 2 or usable[1][1] < 0.01:
            return None
        pair = tuple(self._fitted(() if n == "none" else tuple(n.split("+"))) for n, _ in usable)
        return next_test.propose(pair, (usable[0][1], usable[1][1]))

    def _residual(self, before, after):
        rows, linear = [], after.linear
        scale, left = linear.reduced.angle_scale_rad, [f.residual for f in (before, after)]
        for r, blocks in enumerate(linear.reduced.blocks):
            residuals = [x[r] * scale for x in left]
            rows.append({
                "record": blocks.name, "torque_Nm": blocks.torque_nm.tolist(),
                "direction": blocks.direction[blocks.leg].astype(int).tolist(),
                "before_rad": (residuals[0] - residuals[0].mean()).tolist(),
                "after_rad": (residuals[1] - residuals[1].mean()).tolist(),
                "noise_rad": float(np.sqrt(np.median(np.diag(linear.covariances[r])))) * scale,
            })  # fmt: skip
        return rows


def _doubted(answers, name):
    """The probabilities with a name's share given to unknown."""
    answers = dict(answers)
    answers["unknown"] = answers.get("unknown", 0.0) + answers.pop(name)
    return dict(sorted(answers.items(), key=lambda item: -item[1]))


def _why_inconclusive(unit) -> str:
    checked = check_unit(unit)
    return "" if checked["may_infer"] else checked["reason"]


def _rms(shrunk, fold=None):
    found = {f"{part}_rad": float(np.sqrt(shrunk.mean_square(part, fold))) for part in ("before", "after")}
    return found | {"noise_floor_rad": float(np.sqrt(shrunk.mean_square("floor", fold)))}


def _shifts(before: Posterior, after: Posterior) -> list[dict]:
    """How the reducer's parameters move when the effect is added, in their own standard deviations."""
    rows, old, new = [], posterior_parameters(before), posterior_parameters(after)
    units = {p.name: p.unit for p in PARAMETERS}
    for name, values in old.items():
        sd = max(float(np.std(values)), 1e-300)
        rows.append({
            "parameter": name, "unit": units[name],
            "before": interval(values, LEVEL), "after": interval(new[name], LEVEL),
            "shift_sd": float((np.median(new[name]) - np.median(values)) / sd),
        })  # fmt: skip
    return rows
