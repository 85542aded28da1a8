"""Reader of National Instruments TDMS files."""

from __future__ import annotations

import struct
from pathlib import Path

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows, finite_columns


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen channels by their names, or 'group/channel' where a name occurs in several groups.

    A channel without a unit in its name gets its ``unit_string`` property in brackets.
    """
    try:
        import nptdms
    except ImportError as error:
        raise MissingExtra("reading TDMS", "nptdms", "readers") from error
    try:
        with path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
            channels = _named(file)
            wanted = list(choose(tuple(channels)))
            for name in wanted:
                check_rows(path, len(channels[name]))
            arrays = [channels[name][:] for name in wanted]
    except BadInput:
        raise
    except (ValueError, KeyError, OSError, EOFError, struct.error) as error:
        raise BadInput(path, "a TDMS file", str(error)[:120] or type(error).__name__) from error
    return finite_columns(path, wanted, arrays)


def _named(file) -> dict:
    channels = [(group.name, channel) for group in file.groups() for channel in group.channels()]
    names = [channel.name for _, channel in channels]
    return {_label(group, channel, names.count(channel.name) > 1): channel for group, channel in channels}


def _label(group: str, channel, ambiguous: bool) -> str:
    name = f"{group}/{channel.name}" if ambiguous else channel.name
    unit = channel.properties.get("unit_string")
    return f"{name} [{unit}]" if unit and "[" not in name and "_" not in name else name
