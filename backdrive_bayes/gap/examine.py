"""What a diagnosis rests on: effects weighed, properties of the operator, and how far the likeliest name closes the gap."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import expit

from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.gap import where
from backdrive_bayes.gap.averaged import weighed_unit, with_columns
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.gap.properties import Property, find_properties
from backdrive_bayes.gap.shrink import Fitted, Shrink, fit_hypothesis, shrink, within_reach
from backdrive_bayes.gap.table import STICK_SLIP
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.records.record import Unit

LEVEL = 0.9
LEAST_CLOSED = 0.5
"""A name that closes less of the gap than this on held-out data, with all of its interval below, is unknown."""
CLEAR_GAP = 4.0
"""Mean square of what the class leaves of held-out data, in that of the noise, from which on a name must close the gap: as much
again as the noise in its root."""
MODULE_ODDS = 3.0
"""Log odds of a module that every reducer has and the baseline was asked to do without."""


@one_thread()
def examine(unit: Unit, *, baseline=BASELINE, seed=0, allowed=None, k=0.03, progress=lambda text: None) -> Found:
    """What a diagnosis rests on, before the chosen model is sampled."""
    rng, baseline = np.random.default_rng(seed), tuple(baseline)
    weighed = weighed_unit(unit, BASELINE, allowed, progress)
    withheld = _withheld(weighed.linear, baseline)
    properties = tuple(p for p in find_properties(weighed, rng) if allowed is None or p.name in allowed)
    joint = weighed.joint({p.name: p.probability for p in properties})
    joint = _with_modules(joint, withheld)
    progress("where it lies and how far it shrinks")
    return Found(unit, weighed, properties, joint, withheld, rng, k, baseline, allowed, seed)


def _withheld(linear: Linear, baseline) -> dict[str, float]:
    """Probability of each module that the baseline lacks, from the log marginal likelihood with and without it."""
    found = {}
    for module in BASELINE:
        if module not in baseline:
            names = {p.name for p in linear.reducer.parts if p.module == module}
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
class Found:
    """A unit's effects weighed: ``joint`` holds the probability of every set of them, ``withheld`` that of every module that the
    baseline lacks."""

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
        """The linear model about the mode where no effect acts."""
        return self.weighed.of(())

    @cached_property
    def named(self) -> tuple[str, ...]:
        """The likeliest effects."""
        likeliest = next(iter(self.labels()))
        return () if likeliest == "none" else tuple(likeliest.split("+"))

    @cached_property
    def gap(self) -> where.Gap:
        """What measurement and class leave between them."""
        return where.estimate_gap(self.linear, self.rng, tuple(self.withheld))

    @cached_property
    def fits(self) -> tuple[Fitted, Fitted]:
        """The class without the named effects, not even as traces, and with them; a process of each leg's own fits what is held
        out by itself, so that something unknown closes nothing."""
        named = tuple(e for e in self.named if e != "unknown")
        return self.fitted((), named), self.fitted(named)

    @cached_property
    def held_out(self) -> Shrink:
        """What both leave of records that they have not seen."""
        return shrink(*self.fits, self.gap.weight, self.rng)

    @cached_property
    def closed(self) -> dict | None:
        """Closed fraction of all folds."""
        return self.closed_of()

    @cached_property
    def unsupported(self) -> bool:
        """Whether the name explains too little of held-out data to be one: of all of them, and of those that the others predict
        without extrapolating, where the gap is wider than the noise (a part of less is mostly that of the class)."""
        names = set(self.named) - {p.name for p in self.properties} - {STICK_SLIP, "unknown", *self.withheld}
        folds = within_reach(self.linear)
        closed = self.closed_of(folds) if names and folds else None
        if closed is None or self.closed is None or self.closed["hi"] >= LEAST_CLOSED:
            return False
        return self.held_out.clear_of_noise(folds) > CLEAR_GAP and closed["hi"] < LEAST_CLOSED

    @property
    def shown_left_out(self) -> str:
        """The part of the data in which a gap is clearest once it is left out of the fit; none where it is clear in none."""
        clear = [self.held_out.clear_of_noise(fold) for fold in range(len(self.held_out.names))]
        best = int(np.argmax(clear))
        return self.held_out.names[best] if self.named and clear[best] > CLEAR_GAP else ""

    @property
    def answers(self) -> dict[str, float]:
        """Probabilities by the name of an answer, likeliest first, ``unknown`` where held-out data do not support that."""
        found = self.labels()
        return moved_to_unknown(found, next(iter(found))) if self.unsupported else found

    def labels(self) -> dict[str, float]:
        """Probabilities by the name of an answer, likeliest first."""
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

    def fitted(self, effects, off: tuple[str, ...] = ()) -> Fitted:
        """A hypothesis in the linear model, with what is ``off`` not even a trace; what has no columns of its own stands for
        itself by those of the class."""
        linear = with_columns(self.weighed, effects)
        return fit_hypothesis(linear, effects, levels(linear, tuple(effects), (*off, *self.lacking(effects))))

    def lacking(self, effects) -> tuple[str, ...]:
        """Modules that the baseline was asked to do without and that are not among the effects."""
        return tuple(module for module in self.withheld if module not in effects)

    def closed_of(self, folds=None) -> dict | None:
        """Closed fraction of one fold, several or all; None where only properties are named: the class holds them before and
        after."""
        if self.named and set(self.named) <= {p.name for p in self.properties}:
            return None
        return self.held_out.closed("after", self.rng, LEVEL, folds)


def moved_to_unknown(answers: dict[str, float], name: str) -> dict[str, float]:
    """The probabilities with that of a name moved to unknown."""
    answers = dict(answers)
    answers["unknown"] = answers.get("unknown", 0.0) + answers.pop(name)
    return dict(sorted(answers.items(), key=lambda item: -item[1]))
