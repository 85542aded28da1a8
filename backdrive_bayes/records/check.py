"""Judge a unit's records in numbers and in words."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from backdrive_bayes.records.branches import find_branches, find_segments
from backdrive_bayes.records.faults import find_gaps, find_plateaus, find_wild, longest_frozen, quantum
from backdrive_bayes.records.messages import record_messages, unit_messages
from backdrive_bayes.records.record import Record, Unit
from backdrive_bayes.records.shape import closure, cycle_count, extremes, loading_rate

SCHEMA = "backdrive-bayes/check/1"


def check_unit(unit: Unit) -> dict:
    """Return what is found in every record of ``unit``, ready for JSON, and whether inference may go on.

    Torques are in N·m, angles in rad, times in s. ``messages`` hold a level ('info', 'warning', 'error') and
    a text; any error speaks against inference and ``reason`` repeats it.
    """
    records = [check_record(record, unit.rated_torque_nm) for record in unit.records]
    messages = unit_messages(unit, records)
    errors = [message["text"] for message in messages if message["level"] == "error"]
    warnings = sum(message["level"] == "warning" for message in messages)
    clean = (
        "nothing speaks against it"
        if not warnings
        else f"{warnings} warning{'s'[: warnings != 1]} to keep in mind"
    )
    return {
        "schema": SCHEMA,
        "unit": unit.name,
        "rated_torque_Nm": unit.rated_torque_nm,
        "reduction_ratio": unit.reduction_ratio,
        "identity": dict(unit.identity),
        "data_hash": unit.data_hash,
        "records": records,
        "messages": messages,
        "may_infer": not errors,
        "reason": "; ".join(errors) or clean,
    }


def check_record(record: Record, rated_torque_nm: float) -> dict:
    """Return what is found in one record, ready for JSON; ``messages`` judge it in words."""
    from backdrive_bayes.records.noise import estimate_noise

    time, torque, angle = record.time_s, record.torque_nm, record.angle_rad
    segments = find_segments(time, torque)
    branches = find_branches(time, torque, segments)
    noise = estimate_noise(time, torque, angle, segments)
    low, high = extremes(torque, segments)
    found = {
        "record": record.name,
        "samples": len(time),
        "duration_s": float(time[-1] - time[0]),
        "sampling": _sampling(time),
        "gaps": find_gaps(time, torque),
        "drop_outs": {"torque": int(find_wild(torque).sum()), "angle": int(find_wild(angle).sum())},
        "plateaus": find_plateaus(time, torque, low, high),
        "frozen": {"torque": longest_frozen(torque, angle), "angle": longest_frozen(angle, torque)},
        "angle_quantum_rad": quantum(angle),
        "angle_range_rad": float(np.ptp(angle)),
        "angle_signal_rad": _signal(angle),
        "branches": [_branch(branch, torque) for branch in branches],
        "cycles": int(cycle_count(torque, segments) + 0.05),
        "torque_range_Nm": [low, high],
        "amplitude_Nm": {"estimated": 0.5 * (high - low), "declared": record.amplitude_nm},
        "loading_rate_Nm_per_s": {
            "estimated": loading_rate(time, torque, segments),
            "declared": record.loading_rate_nm_per_s,
        },
        "closure": closure(time, torque, angle, branches, noise),
        "noise": _noise(noise),
        "notes": list(record.notes),
    }
    return {**found, "messages": record_messages(found, rated_torque_nm)}


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


def _noise(noise) -> dict:
    renamed = {"torque_nm": "torque_Nm", "torque_nm_sd": "torque_Nm_sd"}
    return {renamed.get(key, key): value for key, value in asdict(noise).items()}
