"""Refuse what cannot be a torque-angle loop: constant, one-sided, unfinished or with swapped channels."""

from __future__ import annotations

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.branches import Segment, find_segments
from backdrive_bayes.records.record import Record
from backdrive_bayes.records.turning import torque_noise

_FULL_CYCLE = (
    1.8  # torque travelled over its peak-to-peak value: 2 in a full cycle, 1.5 in three quarters of one
)
_LEAST_SIDE = 0.2  # the smaller of the two peaks against the larger
_ABSURD_OVERLOAD = 20.0  # times rated torque: no reducer survives it, a wrong unit or column does
_STRAIGHT = 0.02  # misfit of a commanded ramp against straight flanks, as a share of peak-to-peak
_CURVED_TIMES = 4.0  # how much more the answering channel departs from them
_POINTS = 40_000  # enough to count hundreds of cycles
_SHAPE_POINTS = 4000


def check_plausible(record: Record, rated_torque_nm: float | None, where: str) -> None:
    """Raise BadInput at ``where`` unless ``record`` holds a full torque cycle with its channels in place."""
    torque = record.torque_nm
    largest = float(np.abs(torque).max())
    if np.ptp(torque) <= max(1e-9 * largest, 10.0 * np.finfo(float).tiny):
        raise BadInput(f"{where}, torque", "torque that rises and falls", f"constant {torque[0]:.6g} N·m")
    if np.ptp(record.angle_rad) == 0.0:
        raise BadInput(
            f"{where}, angle", "angle that answers the torque", f"constant {record.angle_rad[0]:.6g} rad"
        )
    _refuse_swapped(record, rated_torque_nm, where)
    if rated_torque_nm is not None and largest > _ABSURD_OVERLOAD * rated_torque_nm:
        raise BadInput(
            f"{where}, torque",
            f"torque near the rated {rated_torque_nm:.6g} N·m",
            f"{largest:.6g} N·m (wrong unit or column?)",
        )
    _refuse_unfinished(record, where)


def _refuse_unfinished(record: Record, where: str) -> None:
    time, torque = _block_means(_POINTS, record.time_s, record.torque_nm)
    segments = find_segments(time, torque)
    levels = _levels(torque, segments)
    travelled, span = float(np.abs(np.diff(levels)).sum()), float(np.ptp(levels))
    if span < 5.0 * torque_noise(torque):
        raise BadInput(f"{where}, torque", "torque that rises and falls", "noise about a constant")
    low, high = min(levels), max(levels)
    seen = f"{low:.4g} to {high:.4g} N·m in {len(segments)} ramp{'s'[: len(segments) != 1]}"
    if min(-low, high) < _LEAST_SIDE * max(-low, high):
        raise BadInput(f"{where}, torque", "a full cycle through positive and negative torque", seen)
    if travelled < _FULL_CYCLE * span:
        raise BadInput(
            f"{where}, torque",
            "at least one full torque cycle",
            f"{travelled / span / 2.0:.2g} of one: {seen}",
        )


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
        raise BadInput(
            f"{where}, columns torque and angle", "straight ramps of torque", f"{found}: channels swapped?"
        )


def _misfit(time: np.ndarray, values: np.ndarray) -> float:
    """Root-mean-square departure from straight flanks between turning points, as a share of peak-to-peak."""
    time, values = _block_means(_SHAPE_POINTS, time, values)
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


def _block_means(points: int, *arrays: np.ndarray) -> list[np.ndarray]:
    step = max(1, len(arrays[0]) // points)
    count = len(arrays[0]) // step
    return [array[: count * step].reshape(count, step).mean(axis=1) for array in arrays]
