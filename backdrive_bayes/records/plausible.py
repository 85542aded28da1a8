"""Refuse what cannot be a torque-angle record: constant or swapped channels, numbers of no bench; unfinished cycles are told."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.branches import Segment, find_segments
from backdrive_bayes.records.record import Record
from backdrive_bayes.records.turning import block_means
from backdrive_bayes.records.white_noise import white_noise

FEWEST_READ = 24
"""Samples below which no ramp, branch or noise can be told at all."""
_FULL_CYCLE = 1.8  # torque travelled over its peak-to-peak value: 2 in a full cycle, 1.5 in three quarters of one
_LEAST_SIDE = 0.2  # the smaller of the two peaks against the larger
_STRAIGHT = 0.02  # misfit of a commanded ramp against straight flanks, as a share of peak-to-peak
_CURVED_TIMES = 4.0  # how much more the answering channel departs from them
_SMALLEST = 1e-30  # N·m, rad
_SHORTEST_S, _LONGEST_S = 1e-6, 1e9
_POINTS = 40_000  # enough to count hundreds of cycles
_SHAPE_POINTS = 4000


def refuse_short(samples: int, where: str) -> None:
    """Raise BadInput at ``where`` for a record of too few samples."""
    if samples < FEWEST_READ:
        raise BadInput(where, f"a record of {FEWEST_READ} samples or more", f"{samples} sample{'s'[: samples != 1]}")


def check_plausible(record: Record, rated_torque_nm: float | None, where: str) -> None:
    """Raise BadInput at ``where`` unless ``record`` holds enough samples, of channels that move, each in its place."""
    refuse_short(record.time_s.size, where)
    torque = record.torque_nm
    seconds = float(record.time_s[-1] - record.time_s[0])
    if not _SHORTEST_S < seconds < _LONGEST_S:
        raise BadInput(f"{where}, time", "a record of microseconds to years", f"{seconds:.3g} s (wrong unit?)")
    if np.ptp(torque) <= max(1e-9 * float(np.abs(torque).max()), _SMALLEST):
        raise BadInput(f"{where}, torque", "torque that rises and falls", f"constant {torque[0]:.6g} N·m")
    if np.ptp(record.angle_rad) <= _SMALLEST:
        raise BadInput(f"{where}, angle", "angle that answers the torque", f"constant {record.angle_rad[0]:.6g} rad")
    _refuse_swapped(record, rated_torque_nm, where)


def why_unfinished(time_s: np.ndarray, torque_nm: np.ndarray) -> str:
    """What keeps a record from holding a full torque cycle, empty where nothing does."""
    block = max(1, len(time_s) // _POINTS)
    time, torque = block_means(time_s, block), block_means(torque_nm, block)
    segments = find_segments(time, torque)
    levels = _levels(torque, segments)
    travelled, span = float(np.abs(np.diff(levels)).sum()), float(np.ptp(levels))
    if span < 5.0 * white_noise(torque):
        return "expected torque that rises and falls, found noise about a constant"
    low, high = min(levels), max(levels)
    seen = f"{low:.4g} to {high:.4g} N·m in {len(segments)} ramp{'s'[: len(segments) != 1]}"
    if min(-low, high) < _LEAST_SIDE * max(-low, high):
        return f"expected a full cycle through positive and negative torque, found {seen}"
    if travelled < _FULL_CYCLE * span:
        return f"expected at least one full torque cycle, found {travelled / span / 2.0:.2g} of one: {seen}"
    return ""


def _levels(torque: np.ndarray, segments: tuple[Segment, ...]) -> list[float]:
    """Torque at the record's start, its turning points and its end, averaged over a little noise."""
    edges = [segments[0].start, *(segment.stop for segment in segments)]
    reach = max(1, min(segment.stop - segment.start for segment in segments) // 100)
    return [float(np.mean(torque[max(edge - reach, 0) : edge + reach])) for edge in edges]


def _refuse_swapped(record: Record, rated_torque_nm: float | None, where: str) -> None:
    """Torque is commanded in straight ramps and angle answers in curves; the reverse means swapped columns.

    Where the torque's size is what the unit file promises the shape alone is no proof (a bench may ramp the
    angle).
    """
    expected = record.amplitude_nm or rated_torque_nm
    largest = float(np.abs(record.torque_nm).max())
    if expected is not None and 0.5 * expected <= largest <= 1.5 * expected:
        return
    angle, torque = (_misfit(record.time_s, values) for values in (record.angle_rad, record.torque_nm))
    if angle < _STRAIGHT and torque > _CURVED_TIMES * angle:
        found = "straight ramps of angle and curves of torque" + (
            f" ({largest:.4g} N·m where {expected:.4g} N·m is declared)" if expected is not None else ""
        )
        way = "channels swapped? Where the angle is what is driven, give amplitude_Nm of this record in unit.toml"
        raise BadInput(f"{where}, columns torque and angle", "straight ramps of torque", f"{found}: {way}")


def _misfit(time: np.ndarray, values: np.ndarray) -> float:
    """Root-mean-square departure from straight flanks between turning points, as a share of peak-to-peak."""
    block = max(1, len(time) // _SHAPE_POINTS)
    time, values = block_means(time, block), block_means(values, block)
    span = float(np.ptp(values))
    if len(values) < 9 or span == 0.0:
        return np.inf
    squares = 0.0
    for segment in find_segments(time, values):
        x, y = time[segment.start : segment.stop], values[segment.start : segment.stop]
        if len(x) > 2:
            line = np.polyfit(x - x.mean(), y, 1)
            squares += float(np.sum((y - np.polyval(line, x - x.mean())) ** 2))
    return float(np.sqrt(squares / len(values))) / span
