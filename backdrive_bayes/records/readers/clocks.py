"""Channels that bring clocks of their own (waveforms, groups): put on one clock, and said where that needed interpolation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.readers.limits import Columns, finite_columns

TIME_HEADER = "time [s]"
"""What a file's own clock is called where no single column holds it."""


@dataclass(frozen=True, eq=False)
class Signal:
    """One channel's values and its own times [s], both of shape (samples,)."""

    header: str
    time_s: np.ndarray
    values: np.ndarray


def on_one_clock(path: Path, signals: Sequence[Signal], note: str) -> Columns:
    """Times [s] of the last signal, and all signals at these times; samples outside of any signal's time are left out."""
    master = signals[-1]
    checked = [finite_columns(path, (TIME_HEADER, s.header), (s.time_s, s.values)).values for s in signals]
    if all(len(t) == len(checked[-1][0]) and np.array_equal(t, checked[-1][0]) for t, _ in checked):
        return Columns((checked[-1][0], *(values for _, values in checked)), 1, (note,))
    for signal, (time, _) in zip(signals, checked, strict=True):
        if len(time) < 2 or np.any(np.diff(time) < 0.0):
            raise BadInput(f"{path}, channel '{signal.header}'", "a clock that rises", "one that runs backwards or is empty")
    begin, end = max(t[0] for t, _ in checked), min(t[-1] for t, _ in checked)
    time = checked[-1][0]
    time = time[(time >= begin) & (time <= end)]
    if len(time) < 2:
        raise BadInput(path, "channels that were recorded at the same time", "clocks that do not overlap")
    values = tuple(np.interp(time, t, v) for t, v in checked)
    others = ", ".join(f"'{s.header}'" for s in signals[:-1])
    return Columns((time, *values), 1, (note, f"{others} interpolated to the times of '{master.header}'"))
