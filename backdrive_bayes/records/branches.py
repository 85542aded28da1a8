"""Cut a record into monotone torque segments, branches and cycles, from the torque alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from backdrive_bayes.records.turning import coarse_turning_points, refine_turning_point
from backdrive_bayes.records.white_noise import white_noise

RISING = {False: "unload-", True: "load+"}  # keyed by whether the torque is positive
FALLING = {True: "unload+", False: "load-"}
_FULL_SHARE = 0.3  # a reversal this large against the last, on both sides of zero, opens a new cycle


@dataclass(frozen=True)
class Segment:
    """Samples [start, stop) between turning points; ``direction`` is +1 for rising torque, -1 for falling."""

    start: int
    stop: int
    direction: int


@dataclass(frozen=True)
class Branch:
    """Samples [start, stop) of a segment on one side of zero torque.

    ``label`` is 'load+' (0 to +T), 'unload+' (+T to 0), 'load-' (0 to -T) or 'unload-' (-T to 0). ``cycle``
    is 0 before the first turning point (the first loading of a fresh record), then 1, 2, … from one full
    reversal of a kind to the next of the same kind.
    """

    start: int
    stop: int
    label: str
    cycle: int


def find_segments(time_s: np.ndarray, torque_nm: np.ndarray) -> tuple[Segment, ...]:
    """Cut a record at its turning points; the segments are contiguous and cover all samples.

    A reversal counts when it exceeds both a share of the peak-to-peak torque and the noise; a dwell or a
    saturated plateau is cut in its middle. Constant torque gives one segment.
    """
    torque = np.asarray(torque_nm, float)
    time = np.asarray(time_s, float)
    edges = [0, *coarse_turning_points(torque), len(torque)]
    for _ in range(2):  # the second pass has better neighbours to look between
        inner = {refine_turning_point(time, torque, *edges[k : k + 3]) for k in range(len(edges) - 2)}
        edges = [0, *sorted(edge for edge in inner if 0 < edge < len(torque)), len(torque)]
    return tuple(Segment(start, stop, _direction(torque[start:stop])) for start, stop in zip(edges[:-1], edges[1:], strict=True))


def find_branches(time_s: np.ndarray, torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> tuple[Branch, ...]:
    """Cut segments at zero torque and number their cycles; the branches cover the segments' samples.

    A segment that only grazes zero within the noise (the start of a first loading) is not cut.
    """
    torque = np.asarray(torque_nm, float)
    peak, noise = float(np.abs(torque).max(initial=0.0)), white_noise(torque)
    branches: list[Branch] = []
    for segment, cycle in zip(segments, cycle_numbers(torque, segments), strict=True):
        labels = RISING if segment.direction > 0 else FALLING
        for start, stop, positive in _sides(torque, segment, peak, noise):
            branches.append(Branch(start, stop, labels[positive], cycle))
    return tuple(branches)


def cycle_numbers(torque_nm: np.ndarray, segments: tuple[Segment, ...]) -> tuple[int, ...]:
    """Number the cycle of each segment; reversals of minor loops inside a cycle do not open a new one."""
    if not segments:
        return ()
    whole = not _starts_inside(torque_nm, segments)
    kind = segments[0].direction * (-1 if whole else 1)  # +1: cycles run from maximum to maximum
    cycle, last, opposite = (1, kind * _level(torque_nm, 0), 0.0) if whole else (0, None, 0.0)
    numbers = [cycle]
    for before, after in zip(segments[:-1], segments[1:], strict=True):
        level = kind * _level(torque_nm, after.start)
        if before.direction != kind:
            opposite = max(opposite, -level)
        elif last is None or min(level, opposite) >= _FULL_SHARE * last:
            cycle, last, opposite = cycle + 1, level, 0.0
        numbers.append(cycle)
    return tuple(numbers)


def _starts_inside(torque: np.ndarray, segments: tuple[Segment, ...]) -> bool:
    """Tell whether the record starts inside a cycle, not at a reversal as large as the one that follows."""
    first = segments[0]
    start, turn = first.direction * torque[0], first.direction * _level(torque, first.stop)
    return len(segments) < 2 or start > -0.9 * abs(turn)


def _level(torque: np.ndarray, index: int) -> float:
    return float(np.median(torque[max(index - 2, 0) : index + 3]))


def _direction(torque: np.ndarray) -> int:
    quarter = max(len(torque) // 4, 1)
    return 1 if torque[-quarter:].mean() >= torque[:quarter].mean() else -1


def _sides(torque: np.ndarray, segment: Segment, peak: float, noise: float):
    """Yield (start, stop, torque is positive) for the part before zero torque and the part after it."""
    part = segment.direction * torque[segment.start : segment.stop]
    tip = max(len(part) // 10, min(3, len(part)))
    least = max(0.04 * peak, 8.0 * noise / np.sqrt(tip))
    before, after = _end_value(part[:tip][::-1]) < -least, _end_value(part[-tip:]) > least
    # in a ramp with symmetric noise the number of negative samples is where it crosses zero
    crossing = segment.start + int(np.count_nonzero(part < 0.0))
    if before and after and segment.start < crossing < segment.stop:
        yield segment.start, crossing, segment.direction < 0
        yield crossing, segment.stop, segment.direction > 0
    else:
        yield segment.start, segment.stop, bool(np.median(segment.direction * part) > 0.0)


def _end_value(values: np.ndarray) -> float:
    """Value at the last sample of a straight line through all."""
    if len(values) < 3:
        return float(values[-1])
    return float(np.polyval(np.polyfit(np.arange(len(values)), values, 1), len(values) - 1))
