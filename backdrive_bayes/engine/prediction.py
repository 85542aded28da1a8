"""Angle for any torque history, from a posterior."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from backdrive_bayes.engine.one_thread import one_thread
from backdrive_bayes.engine.posterior import Posterior
from backdrive_bayes.engine.predictive import block_offsets
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.history import through
from backdrive_bayes.mechanics.part import TOP
from backdrive_bayes.number_text import plain
from backdrive_bayes.records.reduction import loading_rate
from backdrive_bayes.records.turning import SHARE, zigzag

MOST_NODES = 20_000
"""Samples at which the class is evaluated; between them, on one monotone run, curves are straight."""
STRAIGHT = 1 / 16
"""Torque, in shares of the largest, along which what creeps is straight: over twice as much it errs by less than a
ten-thousandth of the range, over eight times as much by a thousandth."""
PRELOADS = np.array([0.0, 1.0, -1.0, 1 / 3, -1 / 3, 2 / 3, -2 / 3])
"""Torques, in the largest measured one, from which a reducer of unknown history may have come, equally probable."""
SLACK = 0.02
"""Share by which a torque may pass the largest measured one without being beyond it."""
RATE_REACH, LONE_RATE_REACH = 3.0, 1.5
"""Factors by which a loading rate may leave those measured, and a lone one, before a prediction says so."""


@one_thread()
def predict_angles(posterior: Posterior, time_s, torque_nm, start: str = "unknown", draws: int = 400) -> np.ndarray:
    """Curves of the angle [rad] at :func:`nodes` of a torque history, shape (about ``draws``, nodes).

    Each curve is one draw with one record's encoder offset and one initial state (``start`` "rest": neutral at the first torque,
    "unknown": unloaded from one of PRELOADS), so that the points of a curve belong together.
    """
    at = nodes(torque_nm)
    time, torque = np.asarray(time_s, float)[at], np.asarray(torque_nm, float)[at]
    rate = loading_rate(time, torque) or float(posterior.records.rate_nm_per_s[0])
    some = posterior.thinned(-(-draws // posterior.shape[0]))
    preloads = PRELOADS if start == "unknown" else np.array([np.nan])
    offsets = np.array(block_offsets(posterior))
    curves = []
    for i, preload in enumerate(preloads):
        part = some.taken(slice(i, None, len(preloads)))
        if part.shape[1]:
            angle = _from(part, time, torque, rate, preload * posterior.context.torque_scale_nm)
            curves.append(angle + np.resize(np.roll(offsets, i), len(angle))[:, None])
    return np.concatenate(curves)


def nodes(torque_nm) -> np.ndarray:
    """Numbers of the samples where a history is evaluated: all of a short one, else turning points and every so manieth."""
    torque = np.asarray(torque_nm, float)
    if torque.size <= MOST_NODES:
        return np.arange(torque.size)
    moving = np.flatnonzero(np.diff(torque))
    turns = moving[1:][np.diff(np.sign(np.diff(torque)[moving])) != 0]
    return np.unique(np.r_[np.linspace(0, torque.size - 1, MOST_NODES).astype(int), turns])


def require_range(posterior: Posterior, torque_nm, extrapolate: bool, where) -> None:
    """BadInput for a history that leaves the measured torques, or with ``extrapolate`` those that the class reaches."""
    largest, highest = float(np.abs(torque_nm).max()), posterior.context.torque_scale_nm
    reach = (TOP if extrapolate else 1.0 + SLACK) * highest
    if not largest <= reach:
        further = f"{TOP * highest:.4g} N·m, {TOP:g} times the largest measured"
        near = f"{highest:.4g} N·m, the largest measured (--extrapolate goes to {TOP * highest:.4g})"
        raise BadInput(where, f"torques up to {further if extrapolate else near}", f"{largest:.4g} N·m")


def range_caveat(posterior: Posterior, torque_nm) -> str:
    """What is to be kept in mind of torques beyond those measured; empty where there are none."""
    largest, highest = float(np.abs(torque_nm).max()), posterior.context.torque_scale_nm
    if largest <= (1.0 + SLACK) * highest:
        return ""
    return f"torques up to {largest:.4g} N·m are beyond the largest measured, {highest:.4g} N·m: the angle there is extrapolated"


def rate_caveat(posterior: Posterior, time_s, torque_nm) -> str:
    """What is to be kept in mind of the loading rate of a history's legs, beside those measured; empty where all are among them.

    From one rate alone nothing is learnt of how friction grows with it, and bands are as wide as a usual law makes them.
    """
    time, torque = np.asarray(time_s, float), np.asarray(torque_nm, float)
    turns = [0, *zigzag(torque.tolist(), SHARE * float(np.ptp(torque))), torque.size - 1] if np.ptp(torque) else []
    legs = (slice(start, stop + 1) for start, stop in itertools.pairwise(turns))
    rates = [rate for leg in legs if (rate := loading_rate(time[leg], torque[leg]))]
    low, high = (float(end(posterior.records.rate_nm_per_s)) for end in (np.min, np.max))
    rate = max(rates, key=lambda r: max(low / r, r / high), default=low)
    lone = high < LONE_RATE_REACH * low
    reach = LONE_RATE_REACH if lone else RATE_REACH
    if low / reach <= rate <= reach * high:
        return ""
    measured = f"the only one measured, {plain(high)} N·m/s" if lone else f"those measured, {plain(low)} to {plain(high)} N·m/s"
    return f"the loading rate of {plain(rate)} N·m/s is far from {measured}: what it does to the angle is extrapolated"


def rest_caveat(posterior: Posterior, time_s, torque_nm) -> str:
    """What is to be kept in mind of rests that last longer than every record; empty where there are none."""
    edges = np.flatnonzero(np.diff(np.diff(torque_nm) == 0.0, prepend=False, append=False))
    longest = float(np.max(np.diff(np.asarray(time_s, float)[edges])[::2], initial=0.0))
    known = max(float(b.end_s[-1] - b.begin_s[0]) for b in posterior.records.blocks)
    if longest <= known:
        return ""
    return f"a rest of {plain(longest)} s is longer than all records ({plain(known)} s): what creeps meanwhile is extrapolated"


def _from(posterior, time, torque, rate, preload_nm):
    """Angles (draws, nodes) from the neutral state, or after ``preload_nm`` unless that is NaN."""
    before = torque[:1] if np.isnan(preload_nm) else np.array([0.0, preload_nm, torque[0]])
    ramp = np.abs(np.diff(before)) / rate
    early = time[0] - np.r_[np.cumsum(ramp[::-1])[::-1], 0.0]
    scale = posterior.context.torque_scale_nm
    # What creeps bends between nodes that lie far apart.
    pieces = np.maximum(np.ceil(np.abs(np.diff(torque)) / (STRAIGHT * scale)), 1.0)
    own = np.r_[0, np.cumsum(pieces)].astype(int)
    time, torque = (np.interp(np.arange(own[-1] + 1), own, along) for along in (time, torque))
    # A record has the thresholds of its own amplitude, whatever went before it.
    history = through(np.r_[early, time], np.r_[before, torque], scale, rate)
    history = replace(history, largest=float(np.abs(torque).max()) / scale)
    return posterior.angles(history, rate)[:, before.size - 1 + own]
