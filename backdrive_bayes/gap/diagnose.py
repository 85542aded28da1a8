"""The whole diagnosis of one unit, from its records to the contract's diagnosis.json."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from backdrive_bayes.gap import draws, next_test, where
from backdrive_bayes.gap.candidates import REFERENCE, Candidates, Weighed, weigh_all
from backdrive_bayes.gap.fast import weigh_fast
from backdrive_bayes.gap.probabilities import Evidences, credible_set, lasting, marginal, probabilities, unlisted
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.gap.shrink import shrink
from backdrive_bayes.indicators.summary import loading_rate_nm_per_s
from backdrive_bayes.inference.discrepancy import amplitude_nm
from backdrive_bayes.model.registry import BASELINE, candidates_beside
from backdrive_bayes.records.check import check_unit
from backdrive_bayes.records.record import Unit
from backdrive_bayes.results import DIAGNOSIS

LEVEL = 0.9


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found: the contract's object and the names of the effects to add to the model, () for none or unknown."""

    json: dict
    effects: tuple[str, ...]


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

    ``allowed`` names the effects of the library (default: all that the baseline does not hold).
    """
    # The arrays are small: BLAS threads would spend their time waiting for each other.
    with threadpool_limits(1, user_api="blas"):
        return _diagnose(unit, tuple(baseline), seed, allowed, k, progress)


def _diagnose(unit, baseline, seed, allowed, k, progress):
    began, rng = time.perf_counter(), np.random.default_rng(seed)
    progress("reducing the records and fitting the baseline")
    setting = Setting.of(unit, rng, baseline)
    candidates = weigh_all(setting, rng, progress, allowed)
    progress("looking for jumps, vibration and encoder error")
    fast, candidates = weigh_fast(setting, candidates)
    evidences = Evidences.of(candidates, fast.within(allowed))
    joint = probabilities(evidences)
    labels = marginal(joint)
    likeliest = next(iter(labels))
    effects = () if likeliest == "none" else tuple(likeliest.split("+"))
    progress("where, and how far it shrinks")
    inconclusive = _why_inconclusive(unit, candidates, evidences)
    found = _Found(setting, candidates, labels, effects, unlisted(joint), inconclusive, rng, k)
    result = found.as_json(baseline, allowed)
    result["seconds"] = time.perf_counter() - began
    named = () if effects == ("unknown",) else effects
    return Diagnosis(result, named)


def _why_inconclusive(unit, candidates, evidences) -> str:
    """Why there is no verdict and what to do, empty where there is one."""
    checked = check_unit(unit)
    if not checked["may_infer"]:
        return checked["reason"]
    if not lasting(evidences, candidates.regained):
        named = " + ".join(candidates.sought) or "the baseline"
        return f"the last fresh search still found a better fit of {named}: run it again with another --seed, or add a record"
    return ""


@dataclass(frozen=True, eq=False)
class _Found:
    setting: Setting
    candidates: Candidates
    labels: dict
    effects: tuple
    unlisted: float
    inconclusive: str
    rng: np.random.Generator
    k: float

    def as_json(self, baseline, allowed) -> dict:
        gap = where.estimate_gap(self.setting, self.candidates.none)
        cells = where.gap_map(self.setting, gap)
        amplitudes = {row["file"]: row["amplitude_Nm"] for row in self._records()}
        chosen = self._chosen()
        whitening = self.setting.whitening(REFERENCE)
        none = self.candidates.none.fitted
        z_none, z_chosen = (draws.laplace_draws(f, whitening, self.rng) for f in (none, chosen.fitted))
        return {
            "schema": DIAGNOSIS,
            "unit": self.setting.unit.name,
            "baseline": list(baseline),
            "level": LEVEL,
            "k": self.k,
            "inconclusive": self.inconclusive,
            "records": self._records(),
            "gap": self._gap(gap),
            "where": {"summary": where.summary(cells, amplitudes), "map": cells},
            "which": self._which(chosen, z_chosen, allowed),
            "answer": self._answer(),
            "shrink": self._shrink(none, chosen, gap, z_none, z_chosen),
            "next_test": self._next_test(whitening),
            "parameter_shift": draws.shifts(none, z_none, chosen.fitted, z_chosen, LEVEL),
            "residual": self._residual(none, chosen.fitted),
            "convergence": None,
        }

    def _records(self):
        return [
            {"file": d.blocks.name, "loading_rate_Nm_per_s": loading_rate_nm_per_s(d)}
            | {"amplitude_Nm": amplitude_nm(self.setting.problem, r)}
            for r, d in enumerate(self.setting.problem.records)
        ]

    def _chosen(self) -> Weighed:
        """The fitted hypothesis behind the answer: the best named one where the answer is unknown or was seen in fine blocks."""
        exact = [w for w in self.candidates.weighed if set(w.effects) == set(self.effects)]
        if exact:
            return exact[0]
        inside = [w for w in self.candidates.weighed if set(w.effects) <= set(self.effects)]
        if self.effects == ("unknown",):
            return self.candidates.best
        return max(inside, key=lambda w: (len(w.effects), w.height))

    def _gap(self, gap):
        weight = gap.weight / gap.weight.sum()
        noise = float(weight @ np.diag(self.setting.noise))
        return {
            "probability": float(1 - self.labels.get("none", 0.0)),
            "unlisted_probability": float(self.unlisted),
            "rms_rad": float(np.sqrt(weight @ gap.mean**2)),
            "noise_floor_rad": float(np.sqrt(noise)),
        }

    def _which(self, chosen, z, allowed):
        listed = {n for n in candidates_beside(self.setting.problem.model.names) if allowed is None or n in allowed}
        labels = {name: 0.0 for name in (*sorted(listed), "unknown", "none")} | self.labels
        table = draws.parameter_table(chosen.fitted, z, LEVEL)
        rows = []
        for label, p in sorted(labels.items(), key=lambda item: -item[1]):
            row = {"effect": label, "probability": float(p)}
            mine = {}
            for name in label.split("+"):
                if name in chosen.effects:
                    mine |= draws.effect_parameters(chosen.fitted, table, name)
            rows.append(row | ({"parameters": mine} if mine else {}))
        return rows

    def _answer(self):
        # No name where there is no verdict.
        names = [] if self.inconclusive else list(self.effects)
        return {"effects": names, "credible_set_90": credible_set(self.labels)}

    def _shrink(self, none, chosen, gap, z_none, z_chosen):
        found, several = shrink(self.setting, none, chosen.fitted, gap.weight), len(self.setting.problem.records) > 1
        return {
            "held_out": "records left out in turn" if several else "legs left out in turn",
            **self._shrunk(found),
            "records": [{"record": name, **self._shrunk(found, fold)} for fold, name in enumerate(found.names)],
            "indicators_at": self._records()[draws.widest(self.setting)],
            "gaussian_process": {"closed_fraction": found.closed("control", self.rng, LEVEL)},
            "indicators": draws.indicator_change(self.setting, none, z_none, chosen.fitted, z_chosen, self.k, LEVEL),
        }

    def _shrunk(self, found, fold=None):
        rms = {f"{part}_rad": float(np.sqrt(found.mean_square(part, fold))) for part in ("before", "after")}
        floor = float(np.sqrt(found.mean_square("floor", fold)))
        return rms | {"noise_floor_rad": floor, "closed_fraction": found.closed("after", self.rng, LEVEL, fold)}

    def _next_test(self, whitening):
        fitted = {"+".join(sorted(w.effects)) or "none": w.fitted for w in self.candidates.weighed}
        likely = [(n, p) for n, p in self.labels.items() if "+".join(sorted(n.split("+"))) in fitted][:2]
        if len(likely) < 2 or likely[1][1] < 0.01:
            return None
        pair = tuple(fitted["+".join(sorted(n.split("+")))] for n, _ in likely)
        return next_test.propose(self.setting, pair, (likely[0][1], likely[1][1]), whitening, self.rng)

    def _residual(self, none, chosen):
        rows = []
        for r, data in enumerate(self.setting.problem.records):
            own = self.setting.places.record == r
            before, after = (f.residual[own] - f.residual[own].mean() for f in (none, chosen))
            rows.append({
                "record": data.blocks.name, "torque_Nm": data.blocks.torque_nm.tolist(),
                "direction": data.path.direction.astype(int).tolist(), "before_rad": before.tolist(), "after_rad": after.tolist(),
                "noise_rad": float(np.sqrt(np.median(np.diag(self.setting.noise)[own]))),
            })  # fmt: skip
        return rows
