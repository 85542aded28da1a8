"""Reader of ASAM MDF version 4 measurement files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.quantities import labelled
from backdrive_bayes.records.readers.clocks import TIME_HEADER, Signal, on_one_clock
from backdrive_bayes.records.readers.limits import MAX_ROWS, Choose, Columns, silence


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen channels by their names, or 'group n/channel' where a name occurs in several groups.

    Units are those of the file, in brackets; the time is the master channel of each group.
    """
    try:
        import asammdf
    except ImportError as error:
        raise MissingExtra("reading MDF", "asammdf", "mdf") from error
    silence("asammdf")
    with path.open("rb") as start:
        if start.read(3) != b"MDF":
            raise BadInput(path, "an MDF file", "another format")
    with asammdf.MDF(path, raise_on_multiple_occurrences=False) as file:
        channels = _named(path, file)
        wanted = list(choose((TIME_HEADER, *channels)))
        others = [name for name in wanted if name != TIME_HEADER]
        signals = [_signal(path, file, name, *channels[name]) for name in others]
    if wanted[0] == TIME_HEADER:
        return on_one_clock(path, signals, "time is that of the groups' master channels")
    table = on_one_clock(path, signals, "")
    return Columns(table.values[1:])


def _named(path: Path, file) -> dict[str, tuple[int, int]]:
    found = []
    for number, group in enumerate(file.groups):
        if group.channel_group.cycles_nr > MAX_ROWS:
            raise BadInput(path, f"at most {MAX_ROWS} samples", f"{group.channel_group.cycles_nr}")
        master = file.masters_db.get(number)
        found += [(number, i, c.name, c.unit) for i, c in enumerate(group.channels) if i != master]
    names = [name for _, _, name, _ in found]
    return {labelled(f"group {g}/{name}" if names.count(name) > 1 else name, unit): (g, i) for g, i, name, unit in found}


def _signal(path: Path, file, name: str, group: int, index: int) -> Signal:
    signal = file.get(group=group, index=index)
    values = np.asarray(signal.samples)
    if values.ndim != 1 or values.dtype.kind not in "fiu":
        raise BadInput(f"{path}, channel '{name}'", "numbers", f"{values.dtype} values")
    return Signal(name, np.asarray(signal.timestamps, float), values)
