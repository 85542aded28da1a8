"""What a check says in words: information, warnings, and errors that speak against inference."""

from __future__ import annotations

import math

from backdrive_bayes.number_text import with_error
from backdrive_bayes.records.faults import held, stands_still
from backdrive_bayes.records.findings import Finding

_FEWEST_STEPS = 20  # of an encoder over a loop; with fewer a step spans as much as standing still


def judge_record(found: dict, rated_torque_nm: float):
    """Findings on what ``check_record`` found of one record's channels, declared values and closure."""
    judges = (_notes, _time, _channels, _plateaus, _declared, _size, _closure, _noise)
    return [finding for judge in judges for finding in judge(found, rated_torque_nm)]


def _notes(found, _):
    for note in found["notes"]:
        yield Finding("note", "reader", note)


def _time(found, _):
    gaps = found["gaps"]
    if gaps:
        worst = max(gaps, key=lambda gap: gap["torque_share"])
        place = f"{worst['seconds']:.3g} s at {worst['at_s']:.4g} s, skips {worst['torque_share']:.1%} of the torque range"
        count = found["gap_count"]
        text = f"{count} gap{'s'[: count != 1]} in time; the worst, {place}"
        yield Finding("error" if worst["torque_share"] > 0.1 else "warning", "gap", text)
    if not found["sampling"]["regular"]:
        yield Finding("note", "uneven_sampling", f"sampling is uneven (steps vary by {found['sampling']['irregularity']:.0%})")
    fewest = min(branch["samples"] for branch in found["branches"])
    if fewest < 20:
        yield Finding("warning", "few_samples_in_branch", f"a branch has only {fewest} sample{'s'[: fewest != 1]}")


def _channels(found, _):
    for channel, other in (("torque", "angle"), ("angle", "torque")):
        wild, frozen = found["drop_outs"][channel], found["frozen"][channel]
        if wild:
            text = f"{wild} isolated {channel} sample{'s'[: wild != 1]} far from the neighbours (drop-outs or spikes)"
            yield Finding("error" if wild > 0.02 * found["samples"] else "warning", "isolated_samples", text)
        text = f"{channel} stands still for {frozen['samples']} samples from sample {frozen['start'] + 1}"
        text = f"{text} while {other} passes {frozen['other_share']:.0%} of its range"
        if stands_still(frozen):
            coarse = _coarse(found) if channel == "angle" else ""
            yield Finding("error", "coarse" if coarse else "frozen", coarse or text)
        elif held(frozen):
            yield Finding("warning", "held", f"{text}: its noise forbids that; it is held, not read, or clipped")
    if unread := found["unread_torque"]:
        place = f"near {unread['torque_Nm']:.4g} N·m for {unread['samples']} samples from sample {unread['start'] + 1}"
        text = f"torque stays {place} while angle goes far there and back: it is not read, though its noise may go on"
        yield Finding("error", "unread_torque", text)
    if breaks := found["torque_breaks"]:
        times = f"{len(breaks)} time{'s'[: len(breaks) != 1]}, first at sample {breaks[0]}"
        text = f"torque jumps against its ramp {times}: drop-outs that last, a loose cable?"
        yield Finding("warning", "torque_breaks", text)
    if (found["angle_quantum_rad"] or 0.0) > found["noise"]["white_rad"]:
        yield Finding("note", "quantised", f"angle comes in steps of {_arcmin(found['angle_quantum_rad']):.3g}′")


def _coarse(found):
    """Words for an angle that stands still because its steps are too large to follow the loop, else none."""
    step = found["angle_quantum_rad"]
    steps = round(found["angle_range_rad"] / step) if step else _FEWEST_STEPS
    if steps >= _FEWEST_STEPS:
        return ""
    return f"angle comes in {steps} step{'s'[: steps != 1]} of {_arcmin(step):.3g}′ only: the encoder is too coarse for this loop"


def _plateaus(found, _):
    for plateau in found["plateaus"]:
        text = f"torque stays near {plateau['torque_Nm']:.4g} N·m for {plateau['seconds']:.3g} s"
        share = f"{plateau['share']:.0%} of that side"
        yield Finding("warning", "plateau", f"{text} ({share}): it is clipped, saturated or dwells there")


def _declared(found, rated):
    for key, what, tolerance, unit in (
        ("amplitude_Nm", "amplitude", 0.05, "N·m"),
        ("loading_rate_Nm_per_s", "loading rate", 0.1, "N·m/s"),
    ):
        declared, estimated = found[key]["declared"], found[key]["estimated"]
        if declared is not None and abs(estimated - declared) > tolerance * declared:
            text = f"declared {what} {declared:.4g} {unit}, but the data show {estimated:.4g} {unit}"
            yield Finding("warning", "declared", text)
    amplitude = found["amplitude_Nm"]["estimated"]
    if amplitude > 1.2 * rated:
        yield Finding("warning", "overload", f"torque reaches ±{amplitude:.4g} N·m, above the rated {rated:.4g} N·m")


def _size(found, _):
    low, high = found["torque_range_Nm"]
    centre, amplitude = 0.5 * (low + high), 0.5 * (high - low)
    if abs(centre) > max(0.02 * amplitude, 0.5 * found["noise"]["torque_Nm"]):
        yield Finding("warning", "off_centre", f"torque runs from {low:.4g} to {high:.4g} N·m: off centre by {centre:.2g} N·m")
    noise, moved = math.hypot(found["noise"]["white_rad"], found["noise"]["correlated_rad"]), found["angle_signal_rad"]
    if moved < 2.0 * noise:
        text = f"angle moves {_arcmin(moved):.3g}′ only, not clear of its noise of {_arcmin(noise):.2g}′"
        yield Finding("error", "lost_in_noise", text)


def _closure(found, _):
    closure = found["closure"]
    if closure is None:
        yield Finding("note", "closure", "the record ends before the loop comes back to a tip: its closure cannot be seen")
        return
    difference, sd = closure["difference_rad"], closure["sd_rad"]
    place = f"{closure['torque_Nm']:.3g} N·m ({closure['basis']})"
    text = f"{with_error(_arcmin(difference), _arcmin(sd), '′')} at {place}"
    if abs(difference) > max(3.0 * sd, 0.02 * found["angle_range_rad"]):
        why = "angle drifts, creeps or ratchets, or its encoder slips"
        yield Finding("warning", "not_closed", f"the loop does not close: {text}; {why}")
    else:
        yield Finding("note", "closure", f"the loop closes to {text}")


def _noise(found, _):
    noise, amplitude = found["noise"]["torque_Nm"], found["amplitude_Nm"]["estimated"]
    if noise > 0.02 * amplitude > 0.0:
        yield Finding("note", "torque_noise", f"torque noise is {noise / amplitude:.0%} of the amplitude")


def _arcmin(angle_rad: float) -> float:
    return 60.0 * math.degrees(angle_rad)
