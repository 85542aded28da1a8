"""Comparison of units: differences and ratios of every indicator at matched rate and amplitude, and how each releases energy."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from backdrive_bayes.decisions.claims import Claims, answer
from backdrive_bayes.decisions.conformance import share
from backdrive_bayes.decisions.evidence import Evidence, same_load, same_lost_motion
from backdrive_bayes.decisions.loops import Loop, NotAvailable
from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import LOADED, UNITS
from backdrive_bayes.indicators.intervals import central
from backdrive_bayes.indicators.same_loop import same_amplitude, same_rate
from backdrive_bayes.results import COMPARISON

ROPE = 0.05
CLEAR = 0.95
"""Probability from which a difference, or its absence, is called so."""
DRAWS = 4000
MECHANISM = ("S_g_over_S", "S_f_over_S", "elastic_share")


@dataclass(frozen=True)
class Matched:
    """A condition that two units share: the loop of each."""

    first: Loop
    second: Loop


def require_rope(rope: float) -> None:
    """BadInput unless the relative difference that counts as none is one."""
    if not 0 < rope < 1:
        raise BadInput("--rope", "a share between 0 and 1", rope)


def require_own_records(units) -> None:
    """BadInput where two ``units``, pairs of what they are called and the hashes of their records, have a record in common: their
    draws are not independent."""
    seen: dict = {}
    for number, (name, hashes) in enumerate(units):
        for digest in hashes:
            first, other = seen.setdefault(digest, (number, name))
            if first != number:
                raise BadInput("compare", "units of different records", f"the same records in '{other}' and '{name}'")


@one_thread()
def compare(evidences, claims: Claims | None = None, rope: float = ROPE, level: float = 0.9, seed: int = 0) -> dict:
    """The comparison object of two or more units.

    ``rope`` is the relative difference that counts as none. Raises BadInput where no two units have a condition in common, or two
    have a record in common.
    """
    evidences = list(evidences)
    if len(evidences) < 2:
        raise BadInput("compare", "two units or more", f"{len(evidences)}")
    require_rope(rope)
    require_own_records((e.where or e.name, e.about["data_sha256"]) for e in evidences)
    names = unique_names(evidences)
    rng = np.random.default_rng([seed, 3])
    pairs = [_pair(a, b, names, evidences, rope, level, rng) for a, b in combinations(range(len(evidences)), 2)]
    if not any(p["conditions"] for p in pairs):
        reasons = "; ".join(dict.fromkeys(r["reason"] for p in pairs for r in p["refused"]))
        raise BadInput(" and ".join(names), "a rate and amplitude in common", reasons)
    return {
        "schema": COMPARISON,
        "names": names,
        "level": level,
        "rope": rope,
        "clear": CLEAR,
        "converged": all(e.converged for e in evidences),
        "pairs": pairs,
        "overlays": _overlays(evidences, names),
        "mechanism": [_mechanism(e, name, level) for e, name in zip(evidences, names, strict=True)],
        "claims": answer(evidences, claims, seed) if claims else None,
        "units": [e.about for e in evidences],
        "reproduction": [e.reproduction for e in evidences],
    }


def unique_names(evidences) -> list[str]:
    """The units' names, numbered where they repeat."""
    names = [e.name for e in evidences]
    return [n if names.count(n) == 1 else f"{n} ({names[: i + 1].count(n)})" for i, n in enumerate(names)]


def match(a: Evidence, b: Evidence) -> tuple[list[Matched], list[dict]]:
    """Conditions that both units were measured at or can be predicted at, and those that were refused with the reason.

    A loop within the measured amplitude is the model's prediction; a rate that was not measured is refused, for the baseline
    does not know rates.
    """
    found: list[Matched] = []
    refused: list[dict] = []
    for own, other, turned in ((a, b, False), (b, a, True)):
        for loop in own.measured:
            try:
                theirs = other.loop(loop.rate, loop.amplitude)
            except NotAvailable as why:
                refused.append({"unit": own.name, "record": loop.text, "against": other.name, "reason": str(why)})
                continue
            pair = Matched(theirs, loop) if turned else Matched(loop, theirs)
            if not any(_alike(pair, f) for f in found):
                found.append(pair)
    return sorted(found, key=lambda m: (-float(f"{m.first.amplitude:.2g}"), m.first.rate)), refused


def _alike(one: Matched, other: Matched) -> bool:
    a, b = one.first, other.first
    return same_rate(a.rate, b.rate) and same_amplitude(a.amplitude, b.amplitude)


def _pair(i, j, names, evidences, rope, level, rng) -> dict:
    a, b = evidences[i], evidences[j]
    matched, refused = match(a, b)
    conditions = []
    for m in matched:
        rows, left_out = _indicators(a, b, m, rope, level, rng)
        conditions.append(
            {
                "loading_rate_Nm_per_s": m.first.rate,
                "amplitude_Nm": min(m.first.amplitude, m.second.amplitude),
                "predicted": [n for n, x in ((names[i], m.first), (names[j], m.second)) if x.predicted],
                "indicators": rows,
                "not_compared": left_out,
            }
        )
    return {"first": names[i], "second": names[j], "conditions": conditions, "refused": refused}


def _indicators(a, b, matched, rope, level, rng):
    rows, left_out = {}, {}
    for name in UNITS:
        try:
            if name == "lost_motion_rad":
                same_lost_motion([a, b])
            if name in LOADED:
                same_load([a, b], [matched.first.amplitude, matched.second.amplitude])
            first, second = a.values(name, matched.first), b.values(name, matched.second)
        except NotAvailable as why:
            left_out[name] = str(why)
            continue
        rows[name] = contrast(first, second, rope, level, rng) | {"unit": UNITS[name]}
        if not (a.converged and b.converged):
            rows[name]["verdict"] = "inconclusive"
    return rows, left_out


def contrast(first, second, rope: float, level: float, rng) -> dict:
    """Difference and ratio of two independent quantities from draws (draws,), with their probabilities and a plain verdict."""
    x, y = paired(first, rng), paired(second, rng)
    difference = x - y
    positive = bool((x > 0).all() and (y > 0).all())
    ratio = x / y if positive else None
    # Equal draws, such as two zeros, speak for neither.
    below = [np.searchsorted(np.sort(second), first, side=side).mean() / second.size for side in ("left", "right")]
    greater = float(np.mean(below))
    equivalent = np.abs(difference) <= rope * 0.5 * np.median(np.abs(x) + np.abs(y)) if ratio is None else (
        (ratio <= 1 + rope) & (ratio >= 1 / (1 + rope))
    )
    inside, above = share(equivalent), share(~equivalent & (difference > 0))
    return {
        "first": central(first, level),
        "second": central(second, level),
        "difference": central(difference, level),
        "ratio": None if ratio is None else central(ratio, level),
        "probability_first_greater": float(np.clip(greater, 0.5 / (x.size + 1), 1 - 0.5 / (x.size + 1))),
        "probability_equivalent": inside,
        "probability_clearly_greater": above,
        "probability_clearly_less": share(~equivalent & (difference < 0)),
        "verdict": _verdict(above, inside, share(~equivalent & (difference < 0))),
    }


def paired(values, rng, draws: int = DRAWS) -> np.ndarray:
    """``draws`` values in random order, each used as often as can be: units are independent, and so must their pairing be."""
    repeats = -(-draws // values.size)
    return np.concatenate([rng.permutation(values) for _ in range(repeats)])[:draws]


def _verdict(greater, equivalent, less):
    for probability, word in ((greater, "greater"), (less, "less"), (equivalent, "equivalent")):
        if probability >= CLEAR:
            return word
    return "undecided"


def _overlays(evidences, names) -> list[dict]:
    """Conditions that two units or more were measured at, with the record of each."""
    out: list[dict] = []
    for evidence, name in zip(evidences, names, strict=True):
        for loop in evidence.measured:
            at = {"loading_rate_Nm_per_s": loop.rate, "amplitude_Nm": loop.amplitude}
            place = next((o for o in out if _near(o, loop)), None)
            if place is None:
                out.append(place := at | {"units": []})
            place["units"].append({"unit": name, "record": loop.records[0]})
    shared = [o for o in out if len(o["units"]) > 1]
    return sorted(shared, key=lambda o: (-float(f"{o['amplitude_Nm']:.2g}"), o["loading_rate_Nm_per_s"]))


def _near(overlay, loop) -> bool:
    rate, amplitude = overlay["loading_rate_Nm_per_s"], overlay["amplitude_Nm"]
    return same_rate(rate, loop.rate) and same_amplitude(amplitude, loop.amplitude)


def _mechanism(evidence: Evidence, name: str, level: float) -> dict:
    """How a unit releases energy: shares of S by geometric error, friction and effects, elastic share of W_abs."""
    rows = []
    for loop in evidence.measured:
        values = {key: evidence.draws.values(key, loop.rate, loop.amplitude) for key in MECHANISM}
        values["rest_over_S"] = 1 - values["S_g_over_S"] - values["S_f_over_S"]
        shown = {k: None if np.isnan(v).any() else central(v, level) for k, v in values.items()}
        rows.append({"loading_rate_Nm_per_s": loop.rate, "amplitude_Nm": loop.amplitude} | shown)
    return {"unit": name, "records": rows}
