"""Prior scales of every group of columns under a hypothesis, and what a unit teaches of them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backdrive_bayes.engine.design import class_priors
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.marginal import Scales, Solution, find_scales
from backdrive_bayes.engine.traces import trace_levels, usual_level
from backdrive_bayes.mechanics.registry import all_effects

OFF = (-14.0, 0.0)
"""Log scale of what does not act at all, not even as a trace."""
PRESENT_SD = 1.0
"""Standard deviation of the log scale of an effect that a hypothesis holds."""


def levels(linear: Linear, hypothesis: tuple[str, ...], off: tuple[str, ...] = ()) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of each group's log scale: effects of the hypothesis are free, or as large as is known, those
    that are ``off`` leave not even a trace, all others are at trace level. A module of the class that is off has no parts."""
    priors = class_priors(linear.reducer) | {p.name: OFF for p in linear.reducer.parts if p.module in off}
    present, gone = ({t.name for n in names for t in all_effects().get(n, ())} for names in (hypothesis, off))
    traces = trace_levels(linear.reduced, linear.design, linear.effects)
    for effect in (e for e in linear.effects if e.name in traces):
        on, level = effect.name in present, traces[effect.name]
        if effect.of_class:
            level = effect.present(linear.reduced.context)
        elif on:
            level = usual_level(effect, linear.reduced.context, level)
        sd = PRESENT_SD if on and not effect.known else 0.0
        priors[effect.name] = OFF if effect.name in gone else (float(np.log(level)), sd)
    for name in linear.design.names:
        priors.setdefault(name, (float(np.log(6e-3)), PRESENT_SD))
    return priors


def learn_scales(linear: Linear, priors: Mapping[str, tuple[float, float]]) -> tuple[Scales, np.ndarray, Solution]:
    """Scales with these priors, the likeliest logarithms of them, searched from those of the joint model, and the solution."""
    scales = linear.design.scales(priors)
    start = np.where(scales.free, [linear.log_scale[n] for n in linear.design.names], scales.mean)
    return scales, *find_scales(linear.data, scales, start)
