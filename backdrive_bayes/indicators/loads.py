"""Backdrivability B = (θ_L, W_L) for loads and rates that the user chooses."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.errors import BadInput
from backdrive_bayes.indicators.indicators import back_drive
from backdrive_bayes.indicators.intervals import LEVEL, interval
from backdrive_bayes.indicators.loop import Loops, loop_grid, settled_loops
from backdrive_bayes.indicators.same_loop import SAME_AMPLITUDE, same_rate

BEYOND = 0.15
"""Standard deviation of the log error of what is turned and absorbed beyond the largest measured torque (by convention)."""
BEYOND_RATES = 0.07
"""The same for rates slower or faster than any measured, for every factor e; about what plastic reducers do (by convention)."""
FURTHEST = 3.0
"""Loads up to this many times the rated torque are answered; beyond, neither data nor priors say anything."""
LAST = 0.1
"""Share of the torque over which the slope is taken that is carried on beyond the largest torque."""


def require_loads(rated_torque_nm: float, loads) -> None:
    """BadInput for a load that lies too far beyond the rated torque."""
    for load in loads:
        if abs(load) > FURTHEST * rated_torque_nm:
            expected = f"a load up to {FURTHEST:g} times the rated torque, {FURTHEST * rated_torque_nm:g} N·m"
            raise BadInput("--load", expected, f"{load:g}")


def loads_json(posterior: Posterior, loads, rate_nm_per_s: float | None = None, level: float = LEVEL) -> list[dict]:
    """B for every load [N·m] at the given rate [N·m/s] or, by default, at every measured one.

    A load arrives at zero torque on the branch that leads to it, of the settled loop of the largest amplitude of that rate or,
    where that is less, of the load's own. ``predicted`` names what was not measured: "load" beyond the largest amplitude of the
    rate, "loading_rate". Beyond the largest torque the last slope is carried on; there and beyond the measured rates intervals
    are widened. Negative loads turn negative angles. Source: eq. (1) and (7), reconstructed.
    """
    require_loads(posterior.rated_torque_nm, loads)
    largest = largest_by_rate(posterior)
    rates = largest if rate_nm_per_s is None else [rate_nm_per_s]
    return [_row(posterior, largest, float(load), float(rate), level) for load in loads for rate in rates]


def largest_by_rate(posterior: Posterior) -> dict[float, int]:
    """The record of largest amplitude at every measured rate [N·m/s], in rising order of the rates."""
    rates, sizes = posterior.records.rate_nm_per_s, posterior.records.amplitude_nm
    best: dict[float, int] = {}
    for record in map(int, np.argsort(rates, kind="stable")):
        rate = next((r for r in best if same_rate(r, rates[record])), float(rates[record]))
        if rate not in best or sizes[record] > sizes[best[rate]] * (1 + SAME_AMPLITUDE):
            best[rate] = record
    return best


def _row(posterior, largest, load, rate, level):
    chosen, measured = _beside(largest, rate)
    amplitude = float(posterior.records.amplitude_nm[chosen].max())
    rng = np.random.default_rng([posterior.seed, 2])
    both = _back_drive(posterior, load, amplitude, rate, rng)
    if not measured and len(chosen) == 1:
        beyond = min(abs(np.log(rate / r)) for r in largest)
        both = both * np.exp(BEYOND_RATES * beyond * rng.standard_normal(both.shape[1]))
    within = abs(load) <= amplitude * (1 + SAME_AMPLITUDE)
    return {
        "load_Nm": load,
        "loading_rate_Nm_per_s": rate,
        "theta_L_rad": interval(both[0], level),
        "W_L_J": interval(both[1], level),
        "records": [posterior.records.names[r] for r in chosen],
        "predicted": ["load"] * (not within) + ["loading_rate"] * (not measured),
    }


def _back_drive(posterior, load, amplitude, rate, rng):
    """θ_L and W_L, shape (2, draws)."""
    highest = posterior.context.torque_scale_nm
    reach = min(max(amplitude, abs(load)), highest)
    loops = settled_loops(posterior, loop_grid(posterior, reach, (load, (1 - LAST) * reach)), rate)
    known = np.stack(back_drive(loops, load))
    if abs(load) <= highest * (1 + SAME_AMPLITUDE):
        return known
    turned = _last_slope(loops if load > 0 else loops.mirrored) * (abs(load) - reach)
    more = np.stack([np.sign(load) * turned, turned * 0.5 * (abs(load) + reach)])
    return known + more * np.exp(BEYOND * rng.standard_normal(known.shape[1]))


def _last_slope(loops: Loops):
    top = float(loops.torque_nm[-1])
    return (loops.at(loops.rising, top) - loops.at(loops.rising, (1 - LAST) * top)) / (LAST * top)


def _beside(largest, rate):
    """Records of the measured rate, or of the rates on either side of one that was not measured; and which it is."""
    for measured, record in largest.items():
        if same_rate(measured, rate):
            return [record], True
    below, above = [r for r in largest if r < rate], [r for r in largest if r > rate]
    return [largest[r] for r in (*below[-1:], *above[:1])], False
