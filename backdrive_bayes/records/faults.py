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
_TIP_STEPS = 2.0  # usual steps by which no tip of a ramp stands out of its neighbours: 1.5 of the median of five
_PLATEAU_TIMES = 5.0  # a triangle spends 5 % of its time in the top 5 %, a sine 20 %; so many times a triangle's is neither
_MOST_LISTED = 20
_FROZEN_SHARE = 0.3  # of the other channel's range passed while one stood exactly still
_STILL_SHARE, _MEANS = 0.02, 200  # of the torque's range, within which it stays the same; parts of a record it is judged by
_DRAG_SHARE = 0.3  # of the largest torque: drag at which clearances are crossed
_DRAG_STEPS = 2.0  # of the usual ones: a torque that goes on so closely has missed nothing
_HELD_SHARE, _HELD_SAMPLES, _HELD_CHANCE = 0.03, 10, 1e-6
# The same, more than a turning point's; samples below which no channel is said to be held; expected runs of the noise alone
_HELD_LONG = 0.1  # of the record's samples: a channel that is not read for so long says nothing of a leg's best part


def gaps_after(time_s: np.ndarray) -> np.ndarray:
    """Numbers of the samples after which the time steps much further than around them, (gaps,)."""
    steps = np.diff(time_s)
    if not steps.size or steps.max() <= _GAP_STEPS * np.median(steps):
        return np.zeros(0, int)
    usual = np.maximum(median_filter(steps, 51, mode="nearest"), np.finfo(float).tiny)
    return np.flatnonzero(steps > _GAP_STEPS * usual)


def find_gaps(time_s: np.ndarray, torque_nm: np.ndarray) -> list[dict]:
    """Time steps far longer than those around them, with the share of the torque range passed meanwhile.

    Of many those are listed, in the order of time, that pass most torque.
    """
    steps, passed, at = np.diff(time_s), np.abs(np.diff(torque_nm)) / float(np.ptp(torque_nm)), gaps_after(time_s)
    listed = np.sort(at[np.argsort(-passed[at], kind="stable")[:_MOST_LISTED]])
    return [{"at_s": float(time_s[k]), "seconds": float(steps[k]), "torque_share": float(passed[k])} for k in listed]


def find_wild(values: np.ndarray, least_share: float = 0.02) -> np.ndarray:
    """Where isolated samples (drop-outs, spikes) lie far from the running median of five, shape (samples,).

    ``least_share`` of the channel's range is the least that counts as far.
    """
    if len(values) < 5:
        return np.zeros(len(values), bool)
    median = median_filter(values, 5, mode="mirror")  # a wild first or last sample does not count twice
    off = np.abs(values - median)
    # A record may begin or end on a steep ramp: of the step to its first sample that counts which the next steps do not have.
    steps = np.abs(np.diff(values))
    off[[0, -1]] = np.maximum(steps[[0, -1]] - np.maximum(steps[[1, -2]], steps[[2, -3]]), 0.0)
    usual = 1.4826 * float(np.median(off[off > 0.0])) if np.any(off > 0.0) else 0.0
    # The range is that of the medians: one spike would hide others.
    return off > max(_WILD_SD * usual, least_share * float(np.ptp(median)), _TIP_STEPS * float(np.median(steps)))


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
    """Longest run of exactly equal values, its share of the record, that of the other channel's range passed meanwhile, and the
    run's ``chance``.

    ``chance`` bounds the expected number of runs so long in a record of a channel that stands still and has this one's noise:
    samples · P(noise stays within one quantum)^(length - 1). It is 1 or more where a quantum hides the noise.
    """
    edges = _edges_of_runs(values)
    return _longest(values, other, edges, np.diff(edges))


def frozen_torque(torque_nm: np.ndarray, angle_rad: np.ndarray) -> dict:
    """As ``longest_frozen``, without the runs of a coarse torque that stands still because a clearance is crossed.

    Such a run lies at the drag, no noise forbids it, and the torque goes on where it left off.
    """
    edges = _edges_of_runs(torque_nm)
    steps, lengths = np.abs(np.diff(torque_nm)), np.diff(edges)
    after = np.append(steps[edges[1:-1] - 1], np.inf)
    usual = float(np.median(after[:-1])) if len(after) > 1 else 0.0
    small = np.abs(torque_nm[edges[:-1]]) <= _DRAG_SHARE * np.abs(torque_nm[~find_wild(torque_nm)]).max()
    free = len(torque_nm) * _share_in_one_quantum(torque_nm) ** (lengths - 1.0) >= _HELD_CHANCE
    crossing = small & free & (after <= _DRAG_STEPS * usual * (1.0 + 1e-9))
    return _longest(torque_nm, angle_rad, edges, np.where(crossing, 0, lengths))


def unread_torque(torque_nm: np.ndarray, angle_rad: np.ndarray) -> dict | None:
    """Where the torque stays the same, noise aside, while the angle goes far there and back: no reducer does, its torque is not
    read. None where there is no such place; a clearance is crossed at one torque, too, but in one direction."""
    edges = np.linspace(0, len(torque_nm), min(_MEANS, len(torque_nm)) + 1).astype(int)
    torque, angle = (np.add.reduceat(values, edges[:-1]) / np.diff(edges) for values in (torque_nm, angle_rad))
    still, far = _STILL_SHARE * float(np.ptp(torque)), _FROZEN_SHARE * float(np.ptp(angle))
    stop = 0
    for start in range(len(torque)):
        while stop < len(torque) and np.ptp(torque[start : stop + 1]) <= still:
            stop += 1
        part = angle[start:stop]
        turns = np.sort([np.argmin(part), np.argmax(part)])
        legs = np.abs(np.diff(part[[0, *turns, -1]]))
        if np.count_nonzero(legs > far) > 1:
            return {"start": int(edges[start]), "samples": int(edges[stop] - edges[start]), "torque_Nm": float(torque[start])}
    return None


def _edges_of_runs(values: np.ndarray) -> np.ndarray:
    """Where runs of equal values begin, and the end of the last."""
    return np.concatenate(([0], np.flatnonzero(np.diff(values) != 0.0) + 1, [len(values)]))


def _longest(values, other, edges, lengths) -> dict:
    """What ``longest_frozen`` tells, of the run of the largest of the ``lengths`` (runs,)."""
    run = int(np.argmax(lengths))
    start, stop = int(edges[run]), int(edges[run + 1])
    means = [part.mean() for part in np.array_split(other[start:stop], min(20, stop - start))]
    moved = float(np.ptp(means))
    span = float(np.ptp(other))
    chance = len(values) * _share_in_one_quantum(values) ** (stop - start - 1)
    return {
        "start": start,
        "samples": stop - start,
        "record_share": (stop - start) / len(values),
        "other_share": moved / span if span > 0.0 else 0.0,
        "chance": chance,
    }


def stands_still(frozen: dict) -> bool:
    """Whether a run of equal values, as from ``longest_frozen``, is a frozen channel and no quantised one.

    Over a turning point the other channel comes back and passes little; there the noise tells.
    """
    far = frozen["other_share"] > _FROZEN_SHARE or (held(frozen) and frozen["record_share"] > _HELD_LONG)
    return frozen["samples"] >= 20 and far


def held(frozen: dict) -> bool:
    """Whether noise makes a run of equal values impossible: the channel was not read."""
    long = frozen["samples"] >= _HELD_SAMPLES and frozen["other_share"] > _HELD_SHARE
    return long and frozen["chance"] < _HELD_CHANCE


def _share_in_one_quantum(values: np.ndarray) -> float:
    """Probability that the channel's noise, at best centred, stays within the channel's own step, 1 without noise."""
    step, second = least_step(values), np.diff(values, 2)
    if not step or not second.size:
        return 1.0
    variance = min(float(np.mean(second**2)), (1.4826 * float(np.median(np.abs(second)))) ** 2) / 6.0
    # A staircase without noise has second differences of at most one step in root mean square.
    variance -= step**2 / 6.0
    return math.erf(step / math.sqrt(8.0 * variance)) if variance > 0.0 else 1.0


def least_step(values: np.ndarray) -> float:
    """By how much the levels of a channel differ that lie next to each other, in the median; zero where there is but one."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-9 * float(np.ptp(values))]  # less are roundings of one level
    return float(np.median(steps)) if steps.size else 0.0


def quantum(values: np.ndarray) -> float | None:
    """Step of a coarsely quantised channel, None where the values are practically continuous."""
    levels = np.unique(values)
    if len(levels) < 2 or len(levels) > 0.5 * len(values):
        return None
    steps = np.diff(levels)
    step = float(np.median(steps))
    return step if np.mean(np.abs(steps / step - np.round(steps / step)) < 0.05) > 0.9 else None
