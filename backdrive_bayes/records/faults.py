"""Faults of a recorded channel: gaps, drop-outs, plateaus and frozen stretches."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from backdrive_bayes.records.record import Record, Unit

SPOILING_SHARE = 0.1
"""Of a channel's range: an isolated sample further off than that is left out before inference."""
_GAP_STEPS = 5.0
_WILD_SD = 12.0
_PLATEAU_TIMES = 4.0  # a triangle spends 5 % of its time in the top 5 %; so many times that is no triangle
_MOST_LISTED = 20
_FROZEN_SHARE = 0.3  # of the other channel's range passed while one stood exactly still
_HELD_SHARE, _HELD_SAMPLES, _HELD_CHANCE = 0.03, 10, 1e-6
# The same, more than a turning point's; samples below which no channel is said to be held; expected runs of the noise alone


def gaps_after(time_s: np.ndarray) -> np.ndarray:
    """Numbers of the samples after which the time steps much further than around them, (gaps,)."""
    steps = np.diff(time_s)
    if not steps.size or steps.max() <= _GAP_STEPS * np.median(steps):
        return np.zeros(0, int)
    usual = np.maximum(median_filter(steps, 51, mode="nearest"), np.finfo(float).tiny)
    return np.flatnonzero(steps > _GAP_STEPS * usual)


def find_gaps(time_s: np.ndarray, torque_nm: np.ndarray) -> list[dict]:
    """Time steps far longer than those around them, with the share of the torque range passed meanwhile."""
    steps, span, at = np.diff(time_s), float(np.ptp(torque_nm)), gaps_after(time_s)
    return [
        {"at_s": float(time_s[k]), "seconds": float(steps[k]), "torque_share": float(abs(torque_nm[k + 1] - torque_nm[k]) / span)}
        for k in at[:_MOST_LISTED]
    ]


def find_wild(values: np.ndarray, least_share: float = 0.02) -> np.ndarray:
    """Where isolated samples (drop-outs, spikes) lie far from the running median of five, shape (samples,).

    ``least_share`` of the channel's range is the least that counts as far.
    """
    if len(values) < 5:
        return np.zeros(len(values), bool)
    median = median_filter(values, 5, mode="nearest")
    off = np.abs(values - median)
    usual = 1.4826 * float(np.median(off[off > 0.0])) if np.any(off > 0.0) else 0.0
    # The range is that of the medians: one spike would hide others.
    return off > max(_WILD_SD * usual, least_share * float(np.ptp(median)))


def without_wild(unit: Unit) -> Unit:
    """The unit less the samples of which either channel is wild enough to spoil means, with notes that say so."""
    return replace(unit, records=tuple(_without_wild(r) for r in unit.records))


def with_wild_bridged(record: Record) -> Record:
    """The record with straight lines in place of those samples: as many samples, so that their numbers stay those of the file."""
    at = np.arange(len(record.time_s))
    channels = {"torque_nm": record.torque_nm, "angle_rad": record.angle_rad}
    wild = {name: find_wild(values, SPOILING_SHARE) for name, values in channels.items()}
    kept = {name: np.interp(at, at[~wild[name]], values[~wild[name]]) for name, values in channels.items() if wild[name].any()}
    return replace(record, **kept)


def _without_wild(record: Record) -> Record:
    """Until no sample is left that is isolated among those that are left: what was done once more would change nothing."""
    left = record
    while (wild := find_wild(left.torque_nm, SPOILING_SHARE) | find_wild(left.angle_rad, SPOILING_SHARE)).any():
        left = replace(left, **{name: getattr(left, name)[~wild] for name in ("time_s", "torque_nm", "angle_rad")})
    count = record.time_s.size - left.time_s.size
    if not count:
        return record
    note = f"{count} isolated sample{'s'[: count != 1]} far from the neighbours left out"
    return replace(left, notes=(*record.notes, note))


def find_plateaus(time_s: np.ndarray, torque_nm: np.ndarray, low: float, high: float) -> list[dict]:
    """Torque levels ``low`` or ``high`` at which the record stays far longer than a ramp that turns there."""
    seconds = np.diff(time_s, append=time_s[-1])
    found = []
    for level, side in ((high, torque_nm > 0.0), (low, torque_nm < 0.0)):
        near = side & (np.abs(torque_nm) > 0.95 * abs(level))
        share = float(seconds[near].sum() / max(seconds[side].sum(), np.finfo(float).tiny))
        if share > 0.05 * _PLATEAU_TIMES:
            found.append({"torque_Nm": level, "seconds": float(seconds[near].sum()), "share": share})
    return found


def longest_frozen(values: np.ndarray, other: np.ndarray) -> dict:
    """Longest run of exactly equal values, the share of the other channel's range passed meanwhile, and the run's ``chance``.

    ``chance`` bounds the expected number of runs so long in a record of a channel that stands still and has this one's noise:
    samples · P(noise stays within one quantum)^(length - 1). It is 1 or more where a quantum hides the noise.
    """
    edges = np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1, [len(values)]))
    run = int(np.argmax(np.diff(edges)))
    start, stop = int(edges[run]), int(edges[run + 1])
    means = [part.mean() for part in np.array_split(other[start:stop], min(20, stop - start))]
    moved = float(np.ptp(means))
    span = float(np.ptp(other))
    chance = len(values) * _share_in_one_quantum(values) ** (stop - start - 1)
    return {"start": start, "samples": stop - start, "other_share": moved / span if span > 0.0 else 0.0, "chance": chance}


def stands_still(frozen: dict) -> bool:
    """Whether a run of equal values, as from ``longest_frozen``, is a frozen channel and no quantised one."""
    return frozen["samples"] >= 20 and frozen["other_share"] > _FROZEN_SHARE


def held(frozen: dict) -> bool:
    """Whether noise makes a run of equal values impossible that is too short to count as standing still."""
    long = frozen["samples"] >= _HELD_SAMPLES and frozen["other_share"] > _HELD_SHARE
    return long and frozen["chance"] < _HELD_CHANCE and not stands_still(frozen)


def _share_in_one_quantum(values: np.ndarray) -> float:
    """Probability that the channel's noise, at best centred, stays within the channel's own step, 1 without noise."""
    steps, second = np.diff(np.unique(values)), np.diff(values, 2)
    steps = steps[steps > 1e-9 * float(np.ptp(values))]  # less are roundings of one level
    if not steps.size or not second.size:
        return 1.0
    step = float(np.median(steps))
    variance = min(float(np.mean(second**2)), (1.4826 * float(np.median(np.abs(second)))) ** 2) / 6.0
    # A staircase without noise has second differences of at most one step in root mean square.
    variance -= step**2 / 6.0
    return math.erf(step / math.sqrt(8.0 * variance)) if variance > 0.0 else 1.0


def quantum(values: np.ndarray) -> float | None:
    """Step of a coarsely quantised channel, None where the values are practically continuous."""
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.5 * len(values):
        return None
    steps = np.diff(levels)
    step = float(np.median(steps))
    return step if np.mean(np.abs(steps / step - np.round(steps / step)) < 0.05) > 0.9 else None
