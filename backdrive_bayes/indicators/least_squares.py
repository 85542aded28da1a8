"""The classic evaluation, shown beside every posterior: eq. (20), reconstructed, fitted by least squares to each branch."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from backdrive_bayes.indicators.draws import core_indicators
from backdrive_bayes.indicators.loop import Loops
from backdrive_bayes.mechanics.published import PublishedLoop
from backdrive_bayes.records.branches import find_segments
from backdrive_bayes.records.record import Record

POINTS = 1000
NAMES = ("offset_rad", "a1", "a3", "a5", "step_rad", "steepness_per_nm", "shift")


def fit_branch(torque_nm, angle_rad, direction: int) -> PublishedLoop:
    """Free least-squares fit of one branch, arrays of shape (samples,); constant friction hides in the offset."""
    scale_t, scale_a = np.abs(torque_nm).max(), max(0.5 * np.ptp(angle_rad), 1e-300)
    x, y = torque_nm / scale_t, (angle_rad - angle_rad.mean()) / scale_a

    def unpack(p):
        return PublishedLoop(p[0], p[1], p[2], p[3], p[4], np.exp(p[5]), p[6])

    def residual(p):
        return unpack(p).angle_rad(x, direction) - y

    def slopes(p):
        top = np.tanh(np.exp(p[5]) * x - direction * p[6])
        rise = p[4] * (1 - top**2)
        return np.stack([np.ones_like(x), x, x**3, x**5, top, rise * np.exp(p[5]) * x, -direction * rise], axis=1)

    starts = ([0.0, 0.4, 0.0, 0.0, 0.5, np.log(b), s * b] for b in (3.0, 30.0) for s in (0.0, 0.05))
    best = min((least_squares(residual, s, slopes, max_nfev=100) for s in starts), key=lambda r: r.cost)
    p = unpack(best.x)
    return PublishedLoop(
        p.offset_rad * scale_a + angle_rad.mean(),
        p.a1 * scale_a / scale_t,
        p.a3 * scale_a / scale_t**3,
        p.a5 * scale_a / scale_t**5,
        p.step_rad * scale_a,
        p.steepness_per_nm / scale_t,
        p.shift,
    )


def least_squares_json(record: Record, rated_torque_nm: float, k: float) -> dict:
    """Branch fits, their quality, and the indicators they imply; null where a branch was not measured."""
    branches = {}
    for segment in find_segments(record.time_s, record.torque_nm):
        part = slice(segment.start, segment.stop, max(1, (segment.stop - segment.start) // POINTS))
        torque, angle = record.torque_nm[part], record.angle_rad[part]
        # The last branch of each direction is the settled one; a quarter loop is no branch.
        if np.ptp(torque) > 0.75 * np.ptp(record.torque_nm) and torque.size > 20:
            branches[segment.direction] = (torque, angle)
    fits = {d: fit_branch(*data, d) for d, data in branches.items()}
    out: dict = {"model": "eq. (20), reconstructed; least squares on each branch", "branches": {}}
    for d, loop in fits.items():
        out["branches"]["ascending" if d > 0 else "descending"] = _branch_json(loop, *branches[d], d, rated_torque_nm)
    out["indicators"] = _indicators(fits, record, rated_torque_nm, k) if len(fits) == 2 else None
    return out


def _branch_json(loop, torque, angle, direction, rated):
    residual = angle - loop.angle_rad(torque, direction)
    high = np.abs(torque) > 0.8 * min(rated, np.abs(torque).max())
    rest = np.sqrt(np.mean(residual[~high] ** 2)) if (~high).any() else np.nan
    return {name: float(getattr(loop, name)) for name in NAMES} | {
        "r_squared": float(1 - residual.var() / angle.var()),
        "rms_rad": float(np.sqrt(np.mean(residual**2))),
        "rms_high_load_over_rest": float(np.sqrt(np.mean(residual[high] ** 2)) / rest) if high.any() else None,
    }


def _indicators(fits, record, rated, k):
    amplitude = 0.5 * float(np.ptp(np.quantile(record.torque_nm, [0.001, 0.999])))
    torque = np.linspace(-amplitude, amplitude, 4001)
    found = core_indicators(Loops(torque, *(fits[d].angle_rad(torque, d)[None] for d in (1, -1))), k * rated)
    return {name: None if np.isnan(value[0]) else float(value[0]) for name, value in found.items()} | {
        # With its free offsets the fit hides friction: the closed form knows only the tanh terms.
        "closed_form_loop_area_J": float(np.mean([f.area_j(amplitude) for f in fits.values()])),
    }
