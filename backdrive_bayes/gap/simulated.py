"""A diagnosis of what a simulator lacks: names, shares of the gap, parameters from and to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from backdrive_bayes.engine.parameters import PARAMETERS, posterior_parameters
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.gap import probabilities, where
from backdrive_bayes.gap.diagnose import SHOWN, Diagnosis, diagnose
from backdrive_bayes.gap.examine import LEVEL
from backdrive_bayes.gap.simulator import Simulator, effects_of, read_simulator, require_reach
from backdrive_bayes.gap.split import PARTS, STAGES, Split
from backdrive_bayes.indicators.draws import IndicatorDraws
from backdrive_bayes.indicators.intervals import central
from backdrive_bayes.number_text import per_cent_text
from backdrive_bayes.records.record import Unit

NO_GAP = "No gap that the data can tell: simulator and unit agree within the noise."
DOUBTFUL = "Whether there is a gap the data do not tell for sure: more samples, or a larger torque, would."
UNTOLD = {"median": None, "lo": None, "hi": None}
"""Shares of a gap that cannot be told mean nothing."""
SHARES = {"closed_by_retuning": "retuning", "closed_by_effect": "effect", "left": "left", "closed_by_both": "both"}
UNCONVERGED = "the fit of the simulator's records has not converged"


def diagnose_simulated(
    unit: Unit,
    simulated: Unit,
    *,
    seed: int = 0,
    allowed=None,
    k: float = 0.03,
    progress: Callable[[str], None] = lambda text: None,
) -> Diagnosis:
    """A diagnosis that speaks of what a simulator lacks, with the split of the gap under ``simulator``.

    ``simulated`` holds what the simulator answered to the unit's or other torque paths. BadInput as of ``diagnose``, and where
    the unit's torques go beyond the simulated ones.
    """
    require_reach(simulated, unit)
    with threadpool_limits(1, user_api="blas"):
        found = diagnose(unit, seed=seed, allowed=allowed, k=k, progress=progress)
        simulator = read_simulator(simulated, found.weighed.linear.reduced, seed, progress)
        progress("splitting the gap")
        return compared(found, simulator, seed, k)


def compared(found: Diagnosis, simulator: Simulator, seed: int, k: float) -> Diagnosis:
    """The diagnosis of a unit set against a simulator."""
    answers = lacking({row["effect"]: row["probability"] for row in found.json["which"]}, simulator.answers)
    named = effects_of(found.json["which"][0]["effect"])
    shared = tuple(e for e in named if e in simulator.effects and e != "unknown")
    split = Split(found.weighed, simulator, shared, effects_of(next(iter(answers))), seed)
    shares = split.shares(LEVEL)
    apart = split.probability()
    told, likely = apart >= 0.5 + LEVEL / 2, max(float(1.0 - answers["none"]), apart)
    inconclusive = found.json["inconclusive"] or ("" if simulator.posterior.converged else UNCONVERGED)
    maps = _maps(split, found.json["records"], np.random.default_rng([seed, 8]))
    lacks = {
        "effects": [] if inconclusive else list(split.lacking),
        "credible_set_90": probabilities.credible_set(answers),
    }
    json = found.json | {
        "inconclusive": inconclusive,
        "gap": found.json["gap"] | {
            "probability": likely,
            "rms_rad": split.rms_rad("simulated"), "noise_floor_rad": _floor_rad(split),
        },
        "where": maps.pop("whole"),
        "which": _which(answers, found.json["which"]),
        "answer": lacks,
        "shrink": _shrink(split, found, k, told),
        "residual": _residual(split, found.json["residual"]),
        "simulator": {
            "unit": simulator.unit.name,
            "data_sha256": list(simulator.unit.data_sha256),
            "effects": list(simulator.effects),
            "shared_effects": list(shared),
            "told": told,
            "summary": summary(shares, told, likely, inconclusive, split.lacking),
            "same_path": [same is not None for same in _same(split)],
            "noise_added": {
                "angle_white_rad": simulator.added.white_rad, "angle_correlated_rad": simulator.added.correlated_rad,
                "torque_Nm": simulator.added.torque_nm,
            },
            **{key: shares[part] if told else UNTOLD for key, part in SHARES.items()},
            "rms_rad": {stage: split.rms_rad(stage) for stage in STAGES} | {"noise_floor": _floor_rad(split)},
            "parts": [{"part": part, **maps[part]} for part in PARTS],
            "records": [
                {"record": name, **{part: split.shares(LEVEL, fold)[part] if told else UNTOLD for part in PARTS}}
                for fold, name in enumerate(split.held_out["simulated"].names)
            ],
            "parameters": parameters(simulator.posterior, found.posterior, told),
            "convergence": simulator.posterior.convergence.to_json(),
        },
    }  # fmt: skip
    return replace(found, json=json)


def lacking(measured: Mapping[str, float], simulated: Mapping[str, float]) -> dict[str, float]:
    """Probabilities of what a unit has and its simulator lacks, by name, likeliest first; both are taken as independent.

    Structure that no listed effect explains is not taken to be the same in both.
    """
    found = {"none": 0.0, "unknown": 0.0}
    for label, p in measured.items():
        for other, q in simulated.items():
            known = set(effects_of(other)) - {"unknown"}
            name = "+".join(e for e in effects_of(label) if e not in known) or "none"
            found[name] = found.get(name, 0.0) + p * q
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def summary(shares, told: bool, likely: float, inconclusive: str, effects: tuple[str, ...]) -> str:
    """The split in one sentence; ``likely`` is the probability of a gap."""
    if inconclusive:
        return "Inconclusive: nothing is named."
    if not told:
        return NO_GAP if likely < 0.5 else DOUBTFUL
    first, second, left = (per_cent_text(shares[part]["median"]) for part in PARTS)
    if not effects:
        return f"Re-tuning closes {first} of the gap; no effect is missing, {left} is left."
    if effects == ("unknown",):
        return f"Re-tuning closes {first} of the gap; {left} is left, of a cause that no listed effect explains."
    return f"Re-tuning closes {first} of the gap, {' and '.join(effects).replace('_', ' ')} a further {second}; {left} is left."


def parameters(simulated: Posterior, measured: Posterior, told: bool) -> list[dict]:
    """The reducer's parameters in the simulator and in the unit, and the change from one to the other, with intervals; where no
    gap is ``told`` none has changed, whatever stands for what in either fit."""
    rows, old, new = [], posterior_parameters(simulated), posterior_parameters(measured)
    rng = np.random.default_rng([measured.seed, 11])
    for p in (p for p in PARAMETERS if p.name in old and p.name in new):
        change = new[p.name] - rng.choice(old[p.name], new[p.name].size)
        moved = central(change, LEVEL)
        rows.append({
            "name": p.name, "unit": p.unit, "simulated": float(np.median(old[p.name])),
            "simulated_interval": central(old[p.name], LEVEL), "measured": central(new[p.name], LEVEL),
            "change": moved, "credible": bool(told and moved["lo"] * moved["hi"] > 0),
        })  # fmt: skip
    return rows


def _same(split):
    reduced = split.linear.reduced
    return [split.simulator.same_path(reduced, r) for r in range(len(reduced.blocks))]


def _floor_rad(split):
    return float(np.sqrt(split.held_out["simulated"].mean_square("floor")))


def _maps(split, records, rng):
    amplitudes = {row["file"]: row["amplitude_Nm"] for row in records}
    cells = {name: where.gap_map(split.linear, gap) for name, gap in split.parts(rng).items()}
    return {name: {"summary": where.summary(found, amplitudes), "map": found} for name, found in cells.items()}


def _which(answers, rows):
    """Every answer with its probability; parameters are those of the unit's own answer that holds it."""
    about = {row["effect"]: row.get("parameters", {}) for row in rows}
    listed = {label: 0.0 for label in about} | answers
    found = []
    for label, p in sorted(listed.items(), key=lambda item: -item[1]):
        held = next((v for name, v in about.items() if v and set(effects_of(label)) <= set(effects_of(name))), {})
        found.append({"effect": label, "probability": float(p)} | ({"parameters": held} if held and effects_of(label) else {}))
    return found


def _shrink(split, found, k, told):
    """How far the gap shrinks on held-out data from the simulator as it is to the re-tuned one with what it lacks; of a gap that
    cannot be ``told`` there is no share."""

    def rms(fold=None):
        stages = zip(("before", "retuned", "after"), STAGES, strict=True)
        floor = float(np.sqrt(split.held_out["simulated"].mean_square("floor", fold)))
        return {f"{key}_rad": split.rms_rad(stage, fold) for key, stage in stages} | {"noise_floor_rad": floor}

    whole, rng = split.held_out["explained"], np.random.default_rng([split.seed, 12])
    at = found.json["shrink"]["indicators_at"]
    loop, change = (at["loading_rate_Nm_per_s"], at["amplitude_Nm"]), {}
    for key, posterior in (("before", split.simulator.posterior), ("after", found.posterior)):
        for name in SHOWN:
            values = IndicatorDraws(posterior, k).values(name, *loop)
            change.setdefault(name, {})[key] = central(values, LEVEL) if np.isfinite(values).all() else None
    return found.json["shrink"] | rms() | {
        "closed_fraction": split.shares(LEVEL)["both"] if told else None,
        "records": [
            {"record": name, **rms(fold), "closed_fraction": split.shares(LEVEL, fold)["both"] if told else None}
            for fold, name in enumerate(whole.names)
        ],
        "gaussian_process": {"closed_fraction": whole.closed("control", rng, LEVEL)},
        "indicators": change,
    }  # fmt: skip


def _residual(split, rows):
    scale, left = split.linear.reduced.angle_scale_rad, split.residuals()
    keys = zip(("before_rad", "retuned_rad", "after_rad"), STAGES, strict=True)
    settled = split.linear.reduced.settled
    stages = {key: [scale * (v[own] - v[own].mean()) for v, own in zip(left[stage], settled, strict=True)] for key, stage in keys}
    return [row | {key: values[r].tolist() for key, values in stages.items()} for r, row in enumerate(rows)]
