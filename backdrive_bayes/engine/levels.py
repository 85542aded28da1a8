"""Prior scales of every group of columns under a hypothesis."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.design import class_priors
from backdrive_bayes.engine.linear import Linear
from backdrive_bayes.engine.traces import trace_of, usual_of
from backdrive_bayes.mechanics.registry import all_effects

PRESENT_SD = 1.0
"""Standard deviation of the log scale of an effect that a hypothesis holds."""


def levels(linear: Linear, hypothesis: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of each group's log scale: effects of the hypothesis are free, all others at trace level."""
    priors = class_priors(linear.reducer)
    present = {t.name for n in hypothesis for t in all_effects().get(n, ())}
    for effect in linear.effects:
        on = effect.name in present
        level = usual_of(linear, effect) if on else trace_of(linear, effect)
        priors[effect.name] = (float(np.log(level)), PRESENT_SD if on else 0.0)
    for name in linear.design.names:
        priors.setdefault(name, (float(np.log(6e-3)), PRESENT_SD))
    return priors
