"""The gap between a simulator and a unit in three parts: what re-tuning closes, what a missing effect closes, what is left."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from backdrive_bayes.engine.design import Design
from backdrive_bayes.engine.levels import levels
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.gap.averaged import with_columns
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.gap.shrink import (
    SMALLEST_GAP,
    Fitted,
    Shrink,
    about_first,
    closed_fraction,
    fit_hypothesis,
    resampled,
    shrink,
)
from backdrive_bayes.gap.simulator import Simulator
from backdrive_bayes.gap.where import Gap
from backdrive_bayes.mechanics.registry import all_effects

PARTS = ("retuning", "effect", "left")
DRAWS = 200
STAGES = ("simulated", "retuned", "explained")
"""The simulator as it is, re-tuned within the class, and with what it lacks beside."""


@dataclass(frozen=True, eq=False)
class Split:
    """The gap of a weighed unit to a simulator; ``shared`` are effects that both have, ``lacking`` those of the unit alone.

    The size of a shared effect is a parameter of the simulator. Weights of the re-tuned simulator are those of the unit's class.
    """

    weighed: Weighed
    simulator: Simulator
    shared: tuple[str, ...]
    lacking: tuple[str, ...]
    seed: int

    @property
    def linear(self) -> Linear:
        """The unit's linear model without any effect."""
        return self.weighed.of(())

    @cached_property
    def gap(self) -> list[np.ndarray]:
        """Measured less simulated angle at the blocks of each record, in shares of the angle scale."""
        reduced = self.linear.reduced
        angles = [self.simulator.along(reduced, r) / reduced.angle_scale_rad for r in range(len(reduced.blocks))]
        return [own - other for own, other in zip(reduced.angles, angles, strict=True)]

    @cached_property
    def fits(self) -> tuple[Fitted, Fitted]:
        """The unit's class with the shared effects and, where the simulator lacks some, not a trace of any other, which would
        stand for them; and with these beside."""
        more = tuple(sorted({*self.shared, *self.lacking} - {"unknown"}))
        before = _fitted(self.weighed, self.shared, tuple({*all_effects()} - {*self.shared}) if self.lacking else ())
        return before, before if set(more) == set(self.shared) else _fitted(self.weighed, more)

    @cached_property
    def held_out(self) -> dict[str, Shrink]:
        """Held-out squares by stage, each in the place of ``after`` with the simulator as it is in that of ``before``."""
        rng = np.random.default_rng([self.seed, 12])
        tuned = shrink(*self.fits, self.linear.reduced.spans_nm, rng)
        group = min(self.linear.design.groups, key=lambda g: g.width)
        alone = replace(self.linear, angles=tuple(self.gap), design=Design((group,)))
        nothing = Fitted((), alone, np.zeros(group.width), np.zeros(group.width), np.zeros((group.width, group.width)))
        bare = shrink(nothing, nothing, self.linear.reduced.spans_nm, rng).before
        after = {"simulated": bare, "retuned": tuned.before, "explained": tuned.after}
        return {stage: replace(tuned, before=bare, after=values) for stage, values in after.items()}

    def rms_rad(self, stage: str, fold: int | None = None) -> float:
        """Root mean square [rad] that a stage leaves of one fold, or of all."""
        return float(np.sqrt(self.held_out[stage].mean_square("after", fold)))

    def shares(self, level: float, fold: int | None = None) -> dict[str, dict]:
        """Shares of the gap above the noise by part, and the closed fraction of the first two ("both"), with intervals."""
        (before, tuned, explained, floor), pieces = self._resampled(fold)
        one, two = closed_fraction(before, tuned, floor), closed_fraction(before, explained, floor)
        found = {"retuning": one, "effect": two - one, "left": 1.0 - two, "both": two}
        return {name: about_first(values, level, pieces) for name, values in found.items()}

    def probability(self) -> float:
        """Share of the resamples in which the gap stands out of the noise."""
        before, _, _, floor = self._resampled(None)[0]
        return float(np.mean(np.sqrt(before / floor) - 1.0 > SMALLEST_GAP))

    def _resampled(self, fold):
        """Mean squares by stage and of the noise, (1 + resamples,) each, and the number of pieces."""
        tuned, both = self.held_out["retuned"], self.held_out["explained"]
        own = np.full(both.fold.size, True) if fold is None else both.fold == fold
        weight = resampled(both.fold[own], np.random.default_rng([self.seed, 10]))
        share = weight @ both.share[own]
        parts = [weight @ p[own] / share for p in (both.before, tuned.after, both.after, both.floor)]
        parts[-1] = parts[-1] + np.sum(weight * both.error[:, own], axis=1) / share
        return parts, int(own.sum())

    def residuals(self) -> dict[str, list[np.ndarray]]:
        """What each stage, fitted to all records, leaves at the blocks of each record, in shares of the angle scale."""
        tuned, explained = (f.residual for f in self.fits)
        return {"simulated": self.gap, "retuned": tuned, "explained": explained}

    def parts(self, rng) -> dict[str, Gap]:
        """The whole gap and its parts in the fits to all records, each with the error of the measurement."""
        left = self.residuals()
        steps = {"whole": (left["simulated"], None), "retuning": (left["simulated"], left["retuned"])}
        steps |= {"effect": (left["retuned"], left["explained"]), "left": (left["explained"], None)}
        scale = self.linear.reduced.angle_scale_rad
        error = tuple(np.linalg.cholesky(c) @ rng.standard_normal((c.shape[0], DRAWS)) * scale for c in self.linear.covariances)
        noise = float(np.sqrt(self.held_out["simulated"].mean_square("floor")))
        found = {}
        for name, (first, second) in steps.items():
            values = first if second is None else [a - b for a, b in zip(first, second, strict=True)]
            spans = self.linear.reduced.spans_nm
            mean = tuple(scale * (v - np.average(v, weights=w)) for v, w in zip(values, spans, strict=True))
            found[name] = Gap(mean, error, spans, noise)
        return found


def _fitted(weighed: Weighed, effects: tuple[str, ...], off: tuple[str, ...] = ()) -> Fitted:
    linear = with_columns(weighed, effects)
    return fit_hypothesis(linear, effects, levels(linear, effects, off))
