"""Reader of National Instruments TDMS files."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.records.quantities import UNITS, is_named, labelled, split_unit
from backdrive_bayes.records.readers.clocks import TIME_HEADER, Signal, on_one_clock
from backdrive_bayes.records.readers.limits import Choose, Columns, check_rows, finite_columns, silence

_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription")
_NO_START = np.datetime64("1904-01-02")  # LabVIEW's clock begins a day before: the start of waveforms that have none


def read(path: Path, choose: Choose) -> Columns:
    """Read the chosen channels by their names, or 'group/channel' where a name occurs in several groups.

    A channel without a unit in its name gets that of its properties in brackets. Where no single channel holds the time, it
    is that of the waveforms' properties or of each group's own time channel.
    """
    try:
        import nptdms
    except ImportError as error:
        raise MissingExtra("reading TDMS", "nptdms", "readers") from error
    silence("nptdms")
    try:
        with path.open("rb") as raw, nptdms.TdmsFile.open(raw) as file:
            columns = _read_channels(path, _named(file), file, choose)
            cut = getattr(getattr(file, "file_status", None), "incomplete_final_segment", False)
            return replace(columns, notes=(*columns.notes, "the file ends before its last segment does")) if cut else columns
    except BadInput:
        raise
    except (ValueError, KeyError, OSError, EOFError, struct.error) as error:
        raise BadInput(path, "a TDMS file", str(error)[:120] or type(error).__name__) from error


def _read_channels(path: Path, channels: dict, file, choose: Choose) -> Columns:
    clocks = {group.name: _clock_of(group) for group in file.groups()}
    times = [name for name in channels if _is_time(name)]
    own_clock = len(times) != 1 or channels[times[0]].dtype.kind == "M"
    headers = tuple(name for name in channels if not (own_clock and name in times))
    if own_clock and any(clock is not None for clock in clocks.values()):
        headers = (TIME_HEADER, *headers)
    wanted = list(choose(headers))
    for name in wanted:
        if name in channels:
            check_rows(path, len(channels[name]))
    if wanted[0] != TIME_HEADER or not own_clock:
        return finite_columns(path, wanted, [channels[name][:] for name in wanted])
    starts = _starts([channels[name] for name in wanted[1:]], clocks)
    signals = [_signal(path, name, channels[name], clocks, start) for name, start in zip(wanted[1:], starts, strict=True)]
    note = "time is that of the groups' own channels" if times else "time is that of the waveforms' properties"
    return on_one_clock(path, signals, note)


def _named(file) -> dict:
    channels = [(group.name, channel) for group in file.groups() for channel in group.channels()]
    names = [channel.name for _, channel in channels]
    return {_label(group, channel, names.count(channel.name) > 1): channel for group, channel in channels}


def _label(group: str, channel, ambiguous: bool) -> str:
    name = f"{group}/{channel.name}" if ambiguous else channel.name
    unit = next((channel.properties[key] for key in _UNIT_PROPERTIES if channel.properties.get(key)), None)
    return labelled(name, str(unit) if unit else None)


def _is_time(label: str) -> bool:
    name, unit = split_unit(label)
    return is_named(name, "time") and (unit in UNITS["time"] or name == label) or is_named(label, "time")


def _clock_of(group):
    """The channel of a group that holds its times, or one with a waveform's properties, or None."""
    for channel in group.channels():
        if _is_time(_label(group.name, channel, False)):
            return channel
    return next((c for c in group.channels() if c.properties.get("wf_increment")), None)


def _source(channel, clocks):
    """The channel that holds the times of another or the properties of its waveform, or None."""
    clock = clocks.get(channel.group_name)
    own = channel if channel.properties.get("wf_increment") else None
    return clock if clock is not None and _is_time(_label("", clock, False)) else own or clock


def _starts(channels, clocks) -> np.ndarray:
    """Seconds by which each waveform starts after the earliest, none where not all of them tell when."""
    sources = [_source(channel, clocks) for channel in channels]
    told = [s.properties.get("wf_start_time") if s is not None and s.properties.get("wf_increment") else None for s in sources]
    if not all(isinstance(start, np.datetime64) and start > _NO_START for start in told):
        return np.zeros(len(channels))
    starts = np.array(told, "datetime64[us]")
    return (starts - starts.min()) / np.timedelta64(1, "s")


def _signal(path: Path, name: str, channel, clocks, start_s: float) -> Signal:
    source = _source(channel, clocks)
    if source is None:
        raise BadInput(f"{path}, channel '{name}'", "a time channel in its group, or wf_increment", "neither")
    if source is channel or source.properties.get("wf_increment"):
        return Signal(name, start_s + _waveform_times(path, name, source, len(channel)), channel[:])
    check_rows(path, len(source))
    return Signal(name, _seconds(source), channel[:])


def _waveform_times(path: Path, name: str, source, count: int) -> np.ndarray:
    step, offset = (source.properties.get(key, 0.0) for key in ("wf_increment", "wf_start_offset"))
    if not (isinstance(step, int | float) and 0.0 < step < 1e9 and isinstance(offset, int | float)):
        raise BadInput(f"{path}, channel '{name}', wf_increment", "a positive number of seconds", repr(step)[:40])
    return float(offset) + float(step) * np.arange(count)


def _seconds(channel) -> np.ndarray:
    values = np.asarray(channel[:])
    if values.dtype.kind == "M":
        return (values - values[:1]) / np.timedelta64(1, "ns") * 1e-9
    _, unit = split_unit(_label("", channel, False))
    return values * UNITS["time"].get(unit, 1.0)
