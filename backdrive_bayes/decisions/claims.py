"""Claims as questions to posteriors: a TOML file of expressions in, probabilities with the numbers behind them out."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

import numpy as np

from backdrive_bayes.decisions.evidence import Evidence, same_load, same_lost_motion
from backdrive_bayes.decisions.expression import PLACE, Expression, Wrong
from backdrive_bayes.decisions.loops import NotAvailable
from backdrive_bayes.decisions.quantities import Quantities
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.draws import LOADED
from backdrive_bayes.indicators.same_loop import same_rate
from backdrive_bayes.number_text import plain
from backdrive_bayes.schemas.claims_file import ClaimsFile, ClaimTable
from backdrive_bayes.schemas.toml_file import read_typed

PAPER = "paper"
HOLDS, FAILS = 0.95, 0.05


@dataclass(frozen=True, eq=False)
class Claim:
    """One question. ``holds`` is a predicate on draws or, with ``is_probability``, a probability that was inferred already.

    ``every`` asks it at every common rate; ``along`` names the axis of its series, between ``low`` and ``high`` [SI].
    """

    number: str
    text: str
    holds: Expression
    is_probability: bool = False
    every: str | None = None
    along: str | None = None
    rate: float | None = None
    amplitude: float | None = None
    low: float = 0.0
    high: float = np.inf
    note: str = ""


@dataclass(frozen=True, eq=False)
class Claims:
    """Claims of one file; ``letters`` call the units in the order in which they are given."""

    claims: tuple[Claim, ...]
    letters: tuple[str, ...]
    source: str


def read_claims(path: Path | str) -> Claims:
    """Read a claims file, or the published claims under the name ``paper``; BadInput names claim and key."""
    path = Path(str(files("backdrive_bayes.decisions") / "paper_claims.toml")) if str(path) == PAPER else Path(path)
    file = read_typed(path, ClaimsFile, f"a claims file or '{PAPER}'")
    claims = tuple(_claim(f"{path}, claim {i}", table, i, file.units) for i, table in enumerate(file.claim, 1))
    return Claims(claims, tuple(file.units), file.source)


def answer(evidences, claims: Claims, seed: int = 0) -> dict:
    """The claims object: of every claim its probability, the numbers behind it and a plain verdict."""
    units = dict(zip(claims.letters, evidences, strict=False))
    quantities = Quantities(units, np.random.default_rng([seed, 4]))
    return {
        "source": claims.source,
        "units": {letter: e.name for letter, e in units.items()},
        "holds_from": HOLDS,
        "fails_below": FAILS,
        "claims": [_answer(c, units, quantities) for c in claims.claims],
    }


def _answer(claim: Claim, units: dict[str, Evidence], quantities) -> dict:
    out = {"id": claim.number, "claim": claim.text, "asked": _asked(claim), "note": claim.note}
    missing = sorted(claim.holds.units - set(units))
    if missing:
        return out | _silent(f"unit {' and '.join(missing)} was not given")
    try:
        held, numbers = _ask(claim, units, quantities)
    except (NotAvailable, Wrong) as why:
        return out | _silent(str(why))
    if claim.is_probability:
        probability = float(np.mean(held))
    else:
        # Pairings repeat draws: what can be told from so many draws is no finer than their number.
        probability = (float(np.mean(held)) * quantities.fewest + 0.5) / (quantities.fewest + 1)
    worst = [units[u].name for u in sorted(claim.holds.units) if not units[u].converged]
    verdict = _verdict(probability) if not worst else "inconclusive"
    reason = f"the sampling of {' and '.join(worst)} has not converged" if worst else ""
    return out | {"probability": probability, "verdict": verdict, "reason": reason, "numbers": numbers}


def _ask(claim, units, quantities):
    """Draws of the answer (draws,), and the numbers behind it."""
    same_lost_motion([units[u] for u in claim.holds.asked_of("lost_motion_rad")])
    rates = _rates(claim, units)
    loaded = [units[u] for u in sorted({u for name in LOADED for u in claim.holds.asked_of(name)})]
    same_load(loaded, [e.loop(e.rates[-1], claim.amplitude).amplitude for e in loaded])
    contexts = [rates] if claim.along == "rate" else [[r] for r in (rates if claim.every == "rate" else [_one(claim, rates)])]
    held, numbers = [], []
    for context in contexts:
        along, look_up = quantities.within(claim, context)
        value = np.asarray(claim.holds.run(look_up, along))
        if value.ndim == 2 and value.shape[1] != 1:
            raise Wrong("the series is left over: reduce it by a function such as spread(…), or ask at every rate")
        if not claim.is_probability and value.dtype != bool:
            raise Wrong("expected a comparison, found a number")
        held.append(value[:, 0] if value.ndim == 2 else np.broadcast_to(value, (quantities.draws,)))
        where = "" if len(contexts) == 1 and claim.every != "rate" else f"{plain(context[0])} N·m/s"
        numbers += [_number(claim, part, look_up, along, where) for part in claim.holds.parts()]
    sizes = {h.size for h in held}
    if len(sizes) > 1:
        raise Wrong("quantities of different kinds cannot be combined in one claim")
    if claim.is_probability and not all(np.all((0.0 <= h) & (h <= 1.0)) for h in held):
        raise Wrong("expected a probability, found a number that is not between 0 and 1")
    return (np.mean if claim.is_probability else np.logical_and.reduce)(held, axis=0), numbers


def _number(claim, part, look_up, along, where):
    text, node, unit = part
    unit = ("N·m/s" if claim.along == "rate" else "N·m") if unit == PLACE else unit
    value = np.atleast_2d(np.asarray(claim.holds.run_part(node, look_up, along), float).T).T
    if not np.isfinite(value).all():
        # A comparison with NaN would be false and look like an answer.
        share = float(np.mean(~np.isfinite(value).reshape(len(value), -1).all(axis=1)))
        raise NotAvailable(f"one of its numbers is not defined in {100 * share:.3g} % of the draws")
    lo, median, hi = np.quantile(value, [0.05, 0.5, 0.95], axis=0)
    out = {"what": text, "at": where, "unit": unit, "level": 0.9}
    if value.shape[1] == 1:
        return out | {"median": float(median[0]), "lo": float(lo[0]), "hi": float(hi[0])}
    return out | {"along": np.asarray(along).tolist(), "median": median.tolist(), "lo": lo.tolist(), "hi": hi.tolist()}


def _rates(claim, units) -> list[float]:
    """Rates that all units of the claim have in common."""
    own = [units[u] for u in sorted(claim.holds.units)] or list(units.values())[:1]
    common = [r for r in own[0].rates if all(any(same_rate(s, r) for s in e.rates) for e in own[1:])]
    if not common:
        raise NotAvailable("the units have no rate in common, and rates cannot be predicted")
    return common


def _one(claim, rates) -> float:
    """The rate of a claim that names none: 0.05 N·m/s, the paper's default, where it was measured."""
    if claim.rate is not None:
        return claim.rate
    return min(rates, key=lambda r: abs(np.log(r / 0.05)))


def _verdict(probability):
    return "holds" if probability >= HOLDS else "does not hold" if probability <= FAILS else "open"


def _silent(reason):
    return {"probability": None, "verdict": "not answered", "reason": reason, "numbers": []}


def _asked(claim: Claim) -> str:
    """The predicate in words and symbols."""
    where = [f"along {claim.along}" if claim.along else "", "at every rate" if claim.every else ""]
    if np.isfinite(claim.high) or claim.low > 0:
        top = f"{claim.high:g}" if np.isfinite(claim.high) else "T"
        where.append(f"between {claim.low:g} and {top} N·m")
    where += [f"at {claim.rate:g} N·m/s" if claim.rate else "", f"at ±{claim.amplitude:g} N·m" if claim.amplitude else ""]
    return ", ".join([claim.holds.text, *(w for w in where if w)])


def _claim(where: str, table: ClaimTable, number: int, letters: list[str]) -> Claim:
    key, text = table.asked
    try:
        expression = Expression.parse(text, letters)
    except Wrong as why:
        raise BadInput(f"{where}, key {key}", *_split(str(why))) from None
    if not expression.units:
        raise BadInput(f"{where}, key {key}", f"a quantity of a unit ({', '.join(letters[:3])} …)", f"'{expression.text}'")
    return Claim(
        number=str(number if table.id is None else table.id),
        text=expression.text if table.text is None else table.text,
        holds=expression,
        is_probability=key == "probability",
        every=table.every,
        along=table.along,
        rate=table.rate,
        amplitude=table.amplitude,
        low=table.low or 0.0,
        high=table.high or np.inf,
        note=table.note,
    )


def _split(text):
    expected, _, found = text.removeprefix("expected ").partition(", found ")
    return expected, found or "something else"
