"""Parameters of the effects that a diagnosis names, with intervals and units."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.gap.table import ENCODER, STICK_SLIP
from backdrive_bayes.indicators.intervals import central
from backdrive_bayes.mechanics.effect import AngleEffect, PathEffect, TangentEffect
from backdrive_bayes.mechanics.registry import all_effects


def effect_parameters(weighed: Weighed, properties, posterior: Posterior, effect: str, level: float) -> dict:
    """Parameters of one effect by name, each with median, lo, hi and unit."""
    for found in properties:
        if found.name == effect:
            place = {"median": found.torque_nm, "lo": found.torque_nm, "hi": found.torque_nm, "unit": "N·m"}
            return {"angle": central(found.size_rad, level) | {"unit": "rad"}, "torque": place}
    if effect == STICK_SLIP:
        size = weighed.jumps.size_rad
        return {"jump": {"median": size, "lo": size, "hi": size, "unit": "rad"}}
    if effect == ENCODER:
        frequency = weighed.frequency.get(weighed.nearest(posterior.hypothesis or ()), weighed.frequency[(ENCODER,)])
        period = weighed.linear.reduced.angle_scale_rad / frequency
        return {"period": {"median": period, "lo": period, "hi": period, "unit": "rad"}}
    return _of_terms(weighed, posterior, effect, level)


def _of_terms(weighed, posterior, effect, level):
    rows, context = {}, posterior.context
    terms = [term for term in all_effects().get(effect, ()) if term.name in posterior.flat]
    for term in (t for t in terms if isinstance(t, TangentEffect)):
        factor = context.torque_scale_nm if term.unit == "N·m" else 1.0
        rows[term.parameter] = central(posterior.flat[term.name][:, 0] * factor, level) | {"unit": term.unit}
    if drawn := [t.name for t in terms if isinstance(t, PathEffect | AngleEffect)]:
        design = weighed.of(posterior.hypothesis).design
        # Each record has an offset of its own.
        records = (np.hstack([design.group(n).of_record(r) for n in drawn]) for r in range(len(design.groups[0].columns)))
        columns = np.vstack([c - c.mean(axis=0) for c in records])
        weights = np.hstack([posterior.flat[n] for n in drawn])
        size = np.sqrt(np.mean((weights @ columns.T) ** 2, axis=1)) * context.angle_scale_rad
        rows[f"{effect}_rms"] = central(size, level) | {"unit": "rad"}
    return rows
