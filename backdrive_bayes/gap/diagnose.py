"""The whole diagnosis of one unit, from its records to the contract's diagnosis.json."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from backdrive_bayes.engine.infer import record_facts
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.parameters import PARAMETERS, posterior_parameters
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.gap import next_test, probabilities, where
from backdrive_bayes.gap.averaged import posterior_of
from backdrive_bayes.gap.examine import LEVEL, Found, examine
from backdrive_bayes.gap.hypotheses import Weighed
from backdrive_bayes.gap.parameters import effect_parameters
from backdrive_bayes.gap.table import ENCODER, STICK_SLIP
from backdrive_bayes.indicators.draws import IndicatorDraws
from backdrive_bayes.indicators.intervals import central
from backdrive_bayes.mechanics.reducer import BASELINE
from backdrive_bayes.mechanics.registry import all_effects
from backdrive_bayes.records.check import check_unit
from backdrive_bayes.records.record import Unit
from backdrive_bayes.results import DIAGNOSIS

SHOWN = ("lost_motion_rad", "loop_area_J", "dissipation_ratio")


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found: the contract's object, the effects of the chosen model, its posterior, which is the one that was
    computed, and the weighed unit that it rests on."""

    json: dict
    effects: tuple[str, ...]
    posterior: Posterior
    weighed: Weighed


@one_thread()
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
    return _finish(examine(unit, baseline=baseline, seed=seed, allowed=allowed, k=k, progress=progress), progress)


def _finish(found: Found, progress) -> Diagnosis:
    """The contract's object, with the posterior of the chosen model."""
    answers, effects = found.answers, ("unknown",) if found.unsupported else found.named
    inconclusive = _why_inconclusive(found.unit)
    listed = tuple(e for e in effects if e in all_effects())
    progress("sampling the chosen model")
    posterior = posterior_of(found.weighed, effects, found.seed, progress, found.lacking(effects))
    none = posterior_of(found.weighed, (), found.seed, progress, found.lacking(())) if effects else posterior
    json = {
        "schema": DIAGNOSIS,
        "unit": found.unit.name,
        "baseline": list(found.baseline),
        "level": LEVEL,
        "k": found.k,
        "inconclusive": inconclusive,
        "records": _records(found),
        "gap": {
            "probability": float(1 - answers.get("none", 0.0)),
            "unlisted_probability": probabilities.unlisted(found.joint),
            "rms_rad": found.gap.rms_rad,
            "noise_floor_rad": found.gap.noise_rad,
        },
        "where": _where(found, effects),
        "which": _which(found, answers, effects, posterior),
        "answer": {"effects": [] if inconclusive else list(effects), "credible_set_90": probabilities.credible_set(answers)},
        "shrink": _shrink(found, none, posterior),
        "next_test": _next_test(found, answers),
        "parameter_shift": _shifts(none, posterior),
        "residual": _residual(found),
        "convergence": posterior.convergence.to_json(),
    }
    return Diagnosis(json, listed, posterior, found.weighed)


def _records(found: Found):
    facts = record_facts(found.linear.reduced)
    return [
        {"file": name, "loading_rate_Nm_per_s": float(rate), "amplitude_Nm": float(amplitude)}
        for name, rate, amplitude in zip(facts.names, facts.rate_nm_per_s, facts.amplitude_nm, strict=True)
    ]


def _where(found: Found, effects):
    cells = where.gap_map(found.linear, found.gap)
    amplitudes = {row["file"]: row["amplitude_Nm"] for row in _records(found)}
    return {"summary": where.summary(cells, amplitudes, found.shown_left_out, bool(effects)), "map": cells}


def _which(found: Found, answers, effects, posterior):
    names = [*all_effects(), ENCODER, STICK_SLIP, *(p.name for p in found.properties), *found.withheld]
    listed = {n: 0.0 for n in names if found.allowed is None or n in found.allowed or n in found.withheld}
    rows = []
    for label, p in sorted((listed | {"unknown": 0.0, "none": 0.0} | answers).items(), key=lambda item: -item[1]):
        told: dict[str, dict] = {}
        if set(label.split("+")) == set(effects):  # of other hypotheses nothing was sampled
            for name in effects:
                told |= effect_parameters(found.weighed, found.properties, posterior, name, LEVEL)
        rows.append({"effect": label, "probability": float(p)} | ({"parameters": told} if told else {}))
    return rows


def _shrink(found: Found, none, posterior):
    shrunk = found.held_out
    widest = int(np.argmax(posterior.records.amplitude_nm))
    change: dict[str, dict] = {}
    for key, drawn in (("before", none), ("after", posterior)):
        loop = IndicatorDraws(drawn, found.k), drawn.records.rate_nm_per_s[widest], drawn.records.amplitude_nm[widest]
        for name in SHOWN:
            values = loop[0].values(name, *loop[1:])
            change.setdefault(name, {})[key] = central(values, LEVEL) if np.isfinite(values).all() else None
    return {
        "held_out": "records left out in turn" if len(posterior.records.names) > 1 else "legs left out in turn",
        **_rms(shrunk),
        "closed_fraction": found.closed,
        "records": [
            {"record": name, **_rms(shrunk, fold), "closed_fraction": found.closed_of(fold)}
            for fold, name in enumerate(shrunk.names)
        ],
        "indicators_at": _records(found)[widest],
        "gaussian_process": {"closed_fraction": shrunk.closed("control", found.rng, LEVEL)},
        "indicators": change,
    }


def _next_test(found: Found, answers):
    usable = [(n, p) for n, p in answers.items() if n != "unknown"][:2]
    if len(usable) < 2 or usable[1][1] < 0.01:
        return None
    one, other = (found.fitted(() if n == "none" else tuple(n.split("+"))) for n, _ in usable)
    return next_test.propose((one, other), (usable[0][1], usable[1][1]))


def _residual(found: Found):
    rows, linear = [], found.fits[1].linear
    scale, left = linear.reduced.angle_scale_rad, [f.residual for f in found.fits]
    for r, (blocks, own) in enumerate(zip(linear.reduced.blocks, linear.reduced.settled, strict=True)):
        # The first loading is not fitted.
        residuals = [x[r][own] * scale for x in left]
        rows.append({
            "record": blocks.name, "torque_Nm": blocks.torque_nm[own].tolist(),
            "direction": blocks.direction[blocks.leg][own].astype(int).tolist(),
            "before_rad": (residuals[0] - residuals[0].mean()).tolist(),
            "after_rad": (residuals[1] - residuals[1].mean()).tolist(),
            "noise_rad": float(np.sqrt(np.median(np.diag(linear.covariances[r])))) * scale,
        })  # fmt: skip
    return rows


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
            "before": central(values, LEVEL), "after": central(new[name], LEVEL),
            "shift_sd": float((np.median(new[name]) - np.median(values)) / sd),
        })  # fmt: skip
    return rows
