"""Backdrivability B = (θ_L, W_L) for loads and rates that the user chooses."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.indicators import back_drive
from backdrive_bayes.indicators.intervals import LEVEL, interval
from backdrive_bayes.indicators.loop import record_amplitude_nm
from backdrive_bayes.indicators.other_loops import OtherLoops
from backdrive_bayes.indicators.summary import loading_rate_nm_per_s
from backdrive_bayes.inference.fit import Posterior
from backdrive_bayes.records.record import Unit

SAME_RATE, SAME_AMPLITUDE = 0.1, 0.01
"""Relative differences up to which two loading rates, and a load and an amplitude, are the same."""
BEYOND = 0.15
"""Standard deviation of the log error of what is turned and absorbed beyond the largest measured amplitude."""
BEYOND_RATES = 0.07
"""The same for rates slower or faster than any measured, for every factor e; about what plastic reducers do (by convention)."""
FURTHEST = 3.0
"""Loads up to this many times the rated torque are answered; beyond, neither data nor priors say anything."""


def require_loads(unit: Unit, loads) -> None:
    """BadInput for a load that lies too far beyond the rated torque."""
    for load in loads:
        if abs(load) > FURTHEST * unit.rated_torque_nm:
            expected = f"a load up to {FURTHEST:g} times the rated torque, {FURTHEST * unit.rated_torque_nm:g} N·m"
            raise BadInput("--load", expected, f"{load:g}")


def loads_json(posterior: Posterior, loads, rate_nm_per_s: float | None = None, level: float = LEVEL) -> list[dict]:
    """B for every load [N·m] at the given rate [N·m/s] or, by default, at every measured one.

    A load arrives at zero torque on the branch that leads to it, of the settled loop of the largest measured amplitude or, where
    that is less, of the load's own. ``predicted`` names what was not measured: "load" beyond the largest amplitude, and
    "loading_rate", for which the model error is that of the measured rates on either side, half of the draws each. Beyond what
    was measured intervals are widened. Negative loads turn negative angles. Source: eq. (1) and (7), reconstructed.
    """
    require_loads(posterior.unit, loads)
    largest = _largest_by_rate(posterior.problem)
    rates = largest if rate_nm_per_s is None else [rate_nm_per_s]
    return [_row(posterior, largest, float(load), float(rate), level) for load in loads for rate in rates]


def _largest_by_rate(problem) -> dict[float, int]:
    """The record of largest amplitude at every measured rate [N·m/s], in rising order of the rates."""
    rates = [loading_rate_nm_per_s(d) for d in problem.records]
    sizes = [record_amplitude_nm(problem, r) for r in range(len(rates))]
    best: dict[float, int] = {}
    for record in map(int, np.argsort(rates, kind="stable")):
        rate = next((r for r in best if _same(r, rates[record])), rates[record])
        if rate not in best or sizes[record] > sizes[best[rate]] * (1 + SAME_AMPLITUDE):
            best[rate] = record
    return best


def _row(posterior, largest, load, rate, level):
    chosen, measured = _beside(largest, rate)
    others = [OtherLoops(posterior, r, np.arange(i, len(posterior.z), len(chosen))) for i, r in enumerate(chosen)]
    rng = np.random.default_rng([posterior.seed, 2])
    both = np.concatenate([_back_drive(x, load, None if measured else rate, rng) for x in others], axis=1)
    if not measured and len(chosen) == 1:
        beyond = min(abs(np.log(rate / r)) for r in largest)
        both = both * np.exp(BEYOND_RATES * beyond * rng.standard_normal(both.shape[1]))
    within = all(_within(x, load) for x in others)
    return {
        "load_Nm": load,
        "loading_rate_Nm_per_s": rate,
        "theta_L_rad": interval(both[0], level),
        "W_L_J": interval(both[1], level),
        "records": [posterior.problem.records[r].blocks.name for r in chosen],
        "predicted": ["load"] * (not within) + ["loading_rate"] * (not measured),
    }


def _back_drive(other, load, rate, rng):
    """θ_L and W_L, shape (2, draws), with an error of their own on what lies beyond the measured amplitude."""
    loops = other.of(max(other.amplitude_nm, abs(load)), (load, other.amplitude_nm), rate)
    both = np.stack(back_drive(loops, load))
    if _within(other, load):
        return both
    known = np.stack(back_drive(loops, np.copysign(other.amplitude_nm, load)))
    return known + (both - known) * np.exp(BEYOND * rng.standard_normal(both.shape[1]))


def _within(other, load):
    return abs(load) <= other.amplitude_nm * (1 + SAME_AMPLITUDE)


def _beside(largest, rate):
    """Records of the measured rate, or of the rates on either side of one that was not measured; and which it is."""
    for measured, record in largest.items():
        if _same(measured, rate):
            return [record], True
    below, above = [r for r in largest if r < rate], [r for r in largest if r > rate]
    return [largest[r] for r in (*below[-1:], *above[:1])], False


def _same(a, b):
    return abs(a / b - 1) <= SAME_RATE
