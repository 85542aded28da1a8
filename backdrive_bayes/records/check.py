"""Judge a unit's records in numbers and in words."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np

from backdrive_bayes.records.branches import find_branches, find_segments
from backdrive_bayes.records.faults import (
    find_gaps,
    find_plateaus,
    find_wild,
    frozen_torque,
    gaps_after,
    longest_frozen,
    quantum,
    unread_torque,
    with_wild_bridged,
)
from backdrive_bayes.records.findings import Finding, errors_of, warnings_of
from backdrive_bayes.records.judge_physics import judge_line, judge_lost_motion, judge_physics, judge_rated_torque
from backdrive_bayes.records.lines import clearest_line
from backdrive_bayes.records.measured_loop import measure_loop
from backdrive_bayes.records.messages import judge_record
from backdrive_bayes.records.noise import ChannelRecord, estimate_noise
from backdrive_bayes.records.plausible import why_unfinished
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.shape import closure, cycle_count, extremes, mean_rate
from backdrive_bayes.records.signs import angle_jumps, angle_rise, gives_energy, torque_breaks, width_reversed
from backdrive_bayes.results import CHECK

LOST_MOTION_SHARE = 0.03
"""k, the share of T_r at which lost motion is taken unless somebody asks for another."""


def check_unit(unit: Unit, k: float = LOST_MOTION_SHARE) -> dict:
    """Return what is found in every record of ``unit``, ready for JSON, and whether inference may go on.

    Torques are in N·m, angles in rad, times in s; ``k`` is the share of T_r at which lost motion is taken. ``findings`` hold a
    level ('error', 'warning', 'note'), a code, a text and the record (None: the unit); any error speaks against inference and
    ``reason`` repeats it. ``messages`` are the same as lines, with level 'info' for a note.
    """
    records = [check_record(record, unit.rated_torque_nm, k) for record in unit.records]
    findings = [*_unit_findings(unit, records), *(Finding(**row) for record in records for row in record["findings"])]
    errors, warnings = errors_of(findings), len(warnings_of(findings))
    clean = "nothing speaks against it" if not warnings else f"{warnings} warning{'s'[: warnings != 1]} to keep in mind"
    return {
        "schema": CHECK,
        "unit": unit.name,
        "rated_torque_Nm": unit.rated_torque_nm,
        "reduction_ratio": unit.reduction_ratio,
        "identity": dict(unit.identity),
        "records": records,
        "findings": [finding.to_json() for finding in findings],
        "messages": [finding.message() for finding in findings],
        "may_infer": not errors,
        "reason": "; ".join(errors) or clean,
    }


def _unit_findings(unit: Unit, records: list[dict]):
    yield from (Finding("note", "unit_file", note) for note in unit.notes)
    yield from judge_rated_torque(unit.rated_torque_nm, max(r["amplitude_Nm"]["estimated"] for r in records))


def check_record(record: Record, rated_torque_nm: float, k: float = LOST_MOTION_SHARE) -> dict:
    """Return what is found in one record, ready for JSON; ``findings`` judge it, ``messages`` are their texts.

    Isolated wild samples are counted and then bridged: inference leaves them out, they say nothing of loop, signs or noise.
    """
    channels = _channels(record)
    record = with_wild_bridged(record)
    time, torque, angle = record.time_s, record.torque_nm, record.angle_rad
    segments = find_segments(time, torque)
    branches = find_branches(time, torque, segments)
    noise = estimate_noise(time, torque, angle, segments)
    line = clearest_line(ChannelRecord(time, torque, angle, segments), noise)
    loop, rise = measure_loop(record, segments, noise), angle_rise(torque, angle, segments, noise)
    low, high = extremes(time, torque, segments)
    found = {
        "record": record.name,
        "samples": len(time),
        "duration_s": float(time[-1] - time[0]),
        "sampling": _sampling(time),
        "gaps": find_gaps(time, torque),
        "gap_count": int(gaps_after(time).size),
        **channels,
        "unread_torque": unread_torque(torque, angle),
        "torque_breaks": [int(k) + 1 for k in torque_breaks(time, torque, segments)],
        "plateaus": find_plateaus(time, torque, low, high),
        "angle_range_rad": float(np.ptp(angle)),
        "angle_signal_rad": max(_signal(angle), abs(rise["rise_rad"])),  # many cycles are alike in all blocks
        "branches": [_branch(branch, torque) for branch in branches],
        "cycles": int(cycle_count(time, torque, segments) + 0.05),
        "torque_range_Nm": [low, high],
        "amplitude_Nm": {"estimated": 0.5 * (high - low), "declared": record.amplitude_nm},
        "loading_rate_Nm_per_s": {"estimated": mean_rate(time, torque, segments), "declared": record.loading_rate_nm_per_s},
        "closure": closure(time, torque, angle, branches, noise),
        "noise": _si_names(asdict(noise)),
        "angle_rise": rise,
        "angle_jumps": angle_jumps(angle, segments),
        "measured_loop": None if loop is None else _si_names(asdict(loop)),
        "energy_given": gives_energy(loop, rise),
        "width_reversed": width_reversed(loop, rise),
        "unfinished": why_unfinished(time, torque),
        "notes": list(record.notes),
    }
    findings = [
        *judge_physics(found, record.columns),
        *judge_lost_motion(found, rated_torque_nm, k),
        *judge_record(found, rated_torque_nm),
        *judge_line(line),
    ]
    named = [replace(finding, record=record.name).to_json() for finding in findings]
    return {**found, "findings": named, "messages": [finding.message(full=False) for finding in findings]}


def _channels(record: Record) -> dict:
    torque, angle = record.torque_nm, record.angle_rad
    return {
        "drop_outs": {"torque": int(find_wild(torque).sum()), "angle": int(find_wild(angle).sum())},
        "frozen": {"torque": frozen_torque(torque, angle), "angle": longest_frozen(angle, torque)},
        "angle_quantum_rad": quantum(angle),
    }


def _sampling(time: np.ndarray) -> dict:
    steps = np.diff(time)
    step = float(np.median(steps))
    irregularity = float(np.percentile(np.abs(steps - step), 90) / step)
    return {"rate_hz": 1.0 / step, "irregularity": irregularity, "regular": irregularity < 0.05}


def _signal(angle: np.ndarray) -> float:
    """Range of the means of fifty blocks: what the angle moves apart from its noise."""
    return float(np.ptp([block.mean() for block in np.array_split(angle, min(50, len(angle)))]))


def _branch(branch, torque: np.ndarray) -> dict:
    part = torque[branch.start : branch.stop]
    return {
        "branch": branch.label,
        "cycle": branch.cycle,
        "start": branch.start,
        "samples": len(part),
        "torque_lo_Nm": float(part.min()),
        "torque_hi_Nm": float(part.max()),
    }


def _si_names(values: dict) -> dict:
    """Keys with the units' own capitals, as all files spell them."""
    return {key.replace("_nm", "_Nm").replace("area_j", "area_J"): value for key, value in values.items()}
