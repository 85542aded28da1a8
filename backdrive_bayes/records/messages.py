"""What a check says in words: information, warnings, and errors that speak against inference."""

from __future__ import annotations

import math

from backdrive_bayes.records.record import Unit

_ARCMIN = 10800.0 / math.pi
_FROZEN_SHARE = 0.3  # of the other channel's range passed while one stood exactly still


def unit_messages(unit: Unit, records: list[dict]) -> list[dict]:
    """Messages of the unit and of all its records, those of a record with its name in front."""
    messages = [_message("info", note) for note in unit.notes]
    for record in records:
        messages += [_message(m["level"], f"{record['record']}: {m['text']}") for m in record["messages"]]
    return messages


def record_messages(found: dict, rated_torque_nm: float) -> list[dict]:
    """Judge what ``check_record`` found."""
    judges = (_notes, _time, _channels, _plateaus, _declared, _size, _closure, _noise)
    return [message for judge in judges for message in judge(found, rated_torque_nm)]


def _message(level: str, text: str) -> dict:
    return {"level": level, "text": text}


def _notes(found, _):
    for note in found["notes"]:
        yield _message("info", note)


def _time(found, _):
    gaps = found["gaps"]
    if gaps:
        worst = max(gaps, key=lambda gap: gap["torque_share"])
        level = "error" if worst["torque_share"] > 0.1 else "warning"
        yield _message(
            level,
            f"{len(gaps)} gap{'s'[: len(gaps) != 1]} in time; the worst, {worst['seconds']:.3g} s at "
            f"{worst['at_s']:.4g} s, skips {worst['torque_share']:.1%} of the torque range",
        )
    if not found["sampling"]["regular"]:
        yield _message("info", f"sampling is uneven (steps vary by {found['sampling']['irregularity']:.0%})")
    fewest = min(branch["samples"] for branch in found["branches"])
    if fewest < 20:
        yield _message("warning", f"a branch has only {fewest} sample{'s'[: fewest != 1]}")


def _channels(found, _):
    for channel, other in (("torque", "angle"), ("angle", "torque")):
        wild = found["drop_outs"][channel]
        if wild:
            level = "error" if wild > 0.02 * found["samples"] else "warning"
            yield _message(
                level,
                f"{wild} isolated {channel} sample{'s'[: wild != 1]} far from the neighbours "
                f"(drop-outs or spikes)",
            )
        frozen = found["frozen"][channel]
        if frozen["samples"] >= 20 and frozen["other_share"] > _FROZEN_SHARE:
            yield _message(
                "error",
                f"{channel} stands still for {frozen['samples']} samples from sample "
                f"{frozen['start'] + 1} while {other} passes {frozen['other_share']:.0%} of its range",
            )
    if (found["angle_quantum_rad"] or 0.0) > found["noise"]["white_rad"]:
        yield _message("info", f"angle comes in steps of {found['angle_quantum_rad'] * _ARCMIN:.3g}′")


def _plateaus(found, _):
    for plateau in found["plateaus"]:
        yield _message(
            "warning",
            f"torque stays near {plateau['torque_Nm']:.4g} N·m for {plateau['seconds']:.3g} s "
            f"({plateau['share']:.0%} of that side): it is clipped, saturated or dwells there",
        )


def _declared(found, rated):
    for key, what, tolerance, unit in (
        ("amplitude_Nm", "amplitude", 0.05, "N·m"),
        ("loading_rate_Nm_per_s", "loading rate", 0.1, "N·m/s"),
    ):
        declared, estimated = found[key]["declared"], found[key]["estimated"]
        if declared is not None and abs(estimated - declared) > tolerance * declared:
            yield _message(
                "warning", f"declared {what} {declared:.4g} {unit}, but the data show {estimated:.4g} {unit}"
            )
    if found["amplitude_Nm"]["estimated"] > 1.2 * rated:
        yield _message(
            "warning",
            f"torque reaches ±{found['amplitude_Nm']['estimated']:.4g} N·m, above the rated {rated:.4g} N·m",
        )


def _size(found, _):
    low, high = found["torque_range_Nm"]
    centre, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    if abs(centre) > max(0.02 * amplitude, 0.5 * found["noise"]["torque_Nm"]):
        yield _message(
            "warning", f"torque runs from {low:.4g} to {high:.4g} N·m: off centre by {centre:.2g} N·m"
        )
    noise = math.hypot(found["noise"]["white_rad"], found["noise"]["correlated_rad"])
    if found["angle_signal_rad"] < 2.0 * noise:
        yield _message(
            "error",
            f"angle moves {found['angle_signal_rad'] * _ARCMIN:.3g}′ only, "
            f"not clear of its noise of {noise * _ARCMIN:.2g}′",
        )


def _closure(found, _):
    closure = found["closure"]
    if closure is None:
        yield _message(
            "info", "the record ends before the loop comes back to a tip: its closure cannot be seen"
        )
        return
    difference, sd = closure["difference_rad"], closure["sd_rad"]
    place = f"{closure['torque_Nm']:.3g} N·m ({closure['basis']})"
    text = f"{difference * _ARCMIN:.2g}′ ± {sd * _ARCMIN:.1g}′ at {place}"
    if abs(difference) > max(3.0 * sd, 0.02 * found["angle_range_rad"]):
        yield _message("warning", f"the loop does not close: {text}; angle drifts, creeps or ratchets")
    else:
        yield _message("info", f"the loop closes to {text}")


def _noise(found, _):
    share = found["noise"]["torque_Nm"] / found["amplitude_Nm"]["estimated"]
    if share > 0.02:
        yield _message("info", f"torque noise is {share:.0%} of the amplitude")
