"""Whether the indicators themselves have converged, and whether they hold what was measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.integrate import trapezoid

from backdrive_bayes.engine.diagnostics import diagnose_draws
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.posterior_file import as_saved
from backdrive_bayes.engine.predictive import covariances_rad2
from backdrive_bayes.indicators.draws import CORE, IndicatorDraws
from backdrive_bayes.indicators.indicators import loop_area_j, peak_angle_rad
from backdrive_bayes.indicators.intervals import ends
from backdrive_bayes.indicators.loop import Loops, loop_grid, settled_loops
from backdrive_bayes.indicators.same_loop import same_amplitude
from backdrive_bayes.records.measured_loop import MeasuredLoop, measured_loops
from backdrive_bayes.records.record import Unit

LEVEL, STANDARD_ERRORS = 0.9, 3.0
"""Level of the interval that is held against a measured value, whatever level is shown, and by how many of the value's standard
errors it is widened."""
SHARE = {"settled": 0.05, "first": 0.3}
"""Share of a measured value by which the interval is widened; a first cycle is read once, along one leg of the settled loop."""


def _width_as_read(loops: Loops, zero_nm: float) -> np.ndarray:
    """Mean width over torques up to ``zero_nm`` [rad], (draws,): the way it is read from samples."""
    near = loops.within(zero_nm)
    return trapezoid(near.width, near.torque_nm, axis=-1) / (2.0 * zero_nm)


CHECKED = (
    ("loop_area_j", "loop area S", "J", lambda loops, loop: loop_area_j(loops)),
    ("half_peak_to_peak_rad", "peak angle", "rad", lambda loops, loop: peak_angle_rad(loops)),
    ("zero_torque_width_rad", "width at zero torque w(0)", "rad", lambda loops, loop: _width_as_read(loops, loop.zero_nm)),
)


def examined(draws: IndicatorDraws, unit: Unit | None = None) -> Posterior:
    """The posterior with the indicators' diagnostics beside its own, and what the measured cycles of ``unit`` say against it."""
    posterior = draws.posterior
    names, columns = [], []
    for record in range(posterior.records.count):
        found = draws.all(draws.rates[record], draws.amplitudes[record])
        names += [f"{name} of {posterior.records.names[record]}" for name in CORE]
        columns += [found[name].reshape(posterior.shape) for name in CORE]
    values = np.stack(columns, axis=-1)
    order = np.broadcast_to(np.arange(values.shape[1]), values.shape[:2])
    own = diagnose_draws(names, values, order, posterior.convergence.evaluations)
    doubts = () if unit is None else tuple(contradictions(draws, measured_loops(unit)))
    return replace(posterior, convergence=posterior.convergence.joined(own), doubts=doubts)


def contradictions(draws: IndicatorDraws, measured: tuple[MeasuredLoop | None, ...]) -> list[str]:
    """One sentence for every measured number that the posterior's interval does not hold, with both numbers."""
    found = []
    first = any(loop is not None and loop.basis == "first" for loop in measured)
    covariances = covariances_rad2(draws.posterior) if first else []
    for record, loop in enumerate(measured):
        if loop is None:
            continue
        loops = _reached(draws, record).late(_lag_nm(draws, record))
        for name, text, unit, function in CHECKED:
            value, sd = getattr(loop, name), getattr(loop, f"{name}_sd")
            if value is None:
                continue
            inferred = function(loops, loop)
            if name == "loop_area_j" and loop.basis == "first":
                left, sd = _left_by_leg(draws.posterior, record, covariances[record])
                value = float(np.median(inferred)) + left
            lo, hi = np.quantile(inferred, ends(LEVEL)[::2])
            room = STANDARD_ERRORS * sd + SHARE[loop.basis] * abs(value)
            if not lo - room <= value <= hi + room:
                other = f"inferred as {lo:.4g} to {hi:.4g} {unit}"
                found.append(f"{text} of {loop.record} was measured as {value:.4g} {unit}, {other}")
    return found


def _left_by_leg(posterior, record, covariance_rad2) -> tuple[float, float]:
    """What the longest leg of a record encloses with its mirror image beyond what the mode predicts of that leg, and its standard
    error [J]: of a first cycle only that leg is of the settled loop, whatever was before."""
    blocks = posterior.records.blocks[record]
    own = blocks.leg == int(np.argmax(np.abs(np.diff(blocks.turning_nm))))
    torque = blocks.torque_nm[own]
    # Its area with that image is twice the one between the curve and its chord.
    step = np.diff(torque)
    weight = np.r_[step, 0.0] + np.r_[0.0, step]
    weight[[0, -1]] -= torque[-1] - torque[0]
    left = blocks.angle_rad[own] - posterior.predicted_rad[record][own]
    return -float(weight @ left), float(np.sqrt(weight @ covariance_rad2[np.ix_(own, own)] @ weight))


def _reached(draws, record) -> Loops:
    """The loop between the torques that were reached, which may miss the declared amplitude and lie off centre."""
    posterior, blocks, rate = draws.posterior, draws.posterior.records.blocks[record], draws.rates[record]
    low, high = blocks.tips_nm
    if high > 0.0 and same_amplitude(-low, high):
        return draws.loops(rate, blocks.amplitude_nm)
    grid = loop_grid(posterior, max(-low, high))
    return settled_loops(posterior, np.r_[low, grid[(grid > low) & (grid < high)], high], rate)


def _lag_nm(draws, record):
    """By how much of the torque the angle channel is late in a record: it widens what was measured, not the reducer's loop."""
    lag = draws.posterior.flat.get("sensor_lag")
    return float(np.median(lag) if lag is not None else draws.posterior.distortion.lag_s) * draws.rates[record]


def judged_convergence(posterior: Posterior, k: float, unit: Unit) -> dict:
    """The ``convergence`` object of a posterior of a unit, as it will be saved, lost motion at ``k`` T_r."""
    return convergence_json(examined(IndicatorDraws(as_saved(posterior), k), unit))


def convergence_json(posterior: Posterior) -> dict:
    """The contract's ``convergence`` object; what the measurement says against the posterior is its advice."""
    found = posterior.convergence.to_json()
    if posterior.doubts:
        found |= {"converged": False, "advice": f"contradicts the measurement: {posterior.doubts[0]}"}
    return found | {"contradictions": list(posterior.doubts)}
