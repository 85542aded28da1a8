"""Findings on signs, wraps, cycles and size: what would make every number of a fit wrong."""

from __future__ import annotations

import math

from backdrive_bayes.number_text import with_error
from backdrive_bayes.records.faults import stands_still
from backdrive_bayes.records.findings import Finding
from backdrive_bayes.records.lines import Line
from backdrive_bayes.records.signs import inverted, not_answering
from backdrive_bayes.records.wraps import LARGEST_STEP_RAD

_DEG = 180.0 / math.pi
_OVERLOADED_TIMES, _UNTESTED_SHARE = 20.0, 0.01  # tested against rated torque: beyond these a unit or a column is wrong
_LEAST_MOVED_RAD, _MOST_MOVED_RAD = 0.1 / 60.0 / _DEG, 30.0 / _DEG
# Between the tips of a loop; a precise reducer gives way by an arcminute, a plastic one by ten degrees.
FEWEST_BETWEEN = 5  # between the torques of lost motion: six tell of a clearance what all samples do, four twice as much
FEWEST_SAMPLES = 60
MOST_CYCLES = 2000


def judge_physics(found: dict, columns: dict[str, str]):
    """Findings of one record on its samples, cycles, signs and wraps."""
    yield from _samples(found)
    yield from _signs(found, columns)
    yield from _jumps(found["angle_jumps"], found["frozen"]["angle"])
    yield from _range(found)
    loop = found["measured_loop"]
    # A frozen channel draws loops of any direction and has a finding of its own.
    if any(stands_still(frozen) for frozen in found["frozen"].values()):
        return
    if found["width_reversed"] and not found["energy_given"]:
        read, sd = (60 * _DEG * loop[key] for key in ("zero_torque_width_rad", "zero_torque_width_rad_sd"))
        yield Finding(
            "error",
            "width_reversed",
            f"at zero torque the angle is less after loading than before: w(0) = {with_error(read, sd, '′')}; no reducer does, "
            "but an encoder that wraps or slips, or a channel that was held",
        )
    if found["energy_given"]:
        area = with_error(1e3 * loop["loop_area_J"], 1e3 * loop["loop_area_J_sd"])
        yield Finding(
            "error",
            "loop_reversed",
            f"the loop is passed the wrong way: its area is {area} mJ, "
            f"a reducer would give energy; torque lags the angle, or time runs backwards",
        )


def judge_rated_torque(rated_nm: float, tested_nm: float):
    """A finding where the rated torque and the largest torque tested cannot belong together; without a ramp none was tested."""
    if tested_nm <= 0.0:
        return
    if not _UNTESTED_SHARE <= tested_nm / rated_nm <= _OVERLOADED_TIMES:
        times = tested_nm / rated_nm
        much = f"{times:.3g} times" if times > 1.0 else f"1/{1.0 / times:.3g} of"
        yield Finding(
            "warning",
            "rated_torque",
            f"the largest torque tested, {tested_nm:.4g} N·m, is {much} the rated {rated_nm:.4g} N·m: wrong unit or column?",
        )


def judge_line(line: Line | None):
    """A finding where something swings in the angle that is no noise."""
    if line is not None and line.disturbs:
        yield Finding(
            "warning",
            "periodic_disturbance",
            f"the angle swings at {line.frequency_hz:.3g} Hz (as sampled), {line.power_ratio:.2g} times the power of the "
            "noise about it: mains hum, vibration, or a ripple of the torque that is not read",
        )


def judge_lost_motion(found: dict, rated_nm: float, k: float):
    """A finding where a record's loop does not reach the torques at which lost motion is taken, or has few samples between."""
    amplitude, rate = found["amplitude_Nm"]["estimated"], found["loading_rate_Nm_per_s"]["estimated"]
    step = rate / found["sampling"]["rate_hz"]
    if amplitude >= k * rated_nm and FEWEST_BETWEEN * step > 2.0 * k * rated_nm:
        yield Finding(
            "warning",
            "lost_motion_coarse",
            f"lost motion is hardly told: samples are {step:.3g} N·m apart, fewer than {FEWEST_BETWEEN} between "
            f"±k·T_r = ±{k * rated_nm:.3g} N·m; sample faster or load slower",
        )
    if amplitude < k * rated_nm:
        yield Finding(
            "warning",
            "lost_motion_undefined",
            f"lost motion is not defined: the loop's ±{amplitude:.4g} N·m does not reach "
            f"k·T_r = {k:g} · {rated_nm:.4g} = {k * rated_nm:.4g} N·m",
        )


def _samples(found):
    if found["samples"] < FEWEST_SAMPLES:
        yield Finding("error", "few_samples", f"only {found['samples']} samples; expected {FEWEST_SAMPLES} or more")
    if found["cycles"] > MOST_CYCLES:
        yield Finding("error", "many_cycles", f"{found['cycles']} cycles; expected at most {MOST_CYCLES} in one record")
    if found["unfinished"]:
        yield Finding("error", "no_cycle", f"torque: {found['unfinished']}")


def _signs(found, columns):
    rise, moved = found["angle_rise"], found["angle_signal_rad"]
    if found["unfinished"]:
        return
    if inverted(rise, moved):
        yield Finding(
            "error",
            "angle_inverted",
            f"the angle falls by {-rise['rise_rad'] * _DEG * 60:.4g}′ where the torque rises: one channel has the wrong sign; "
            f"mend it in unit.toml, under [record.columns]: {_turned('angle', columns)}",
        )
    elif not_answering(rise, moved):
        yield Finding(
            "error",
            "angle_not_answering",
            f"the angle moves {moved * _DEG * 60:.4g}′ but does not follow the torque "
            f"({with_error(rise['rise_rad'] * _DEG * 60, rise['sd_rad'] * _DEG * 60, '′')} over a ramp): wrong column?",
        )


def _turned(kind, columns) -> str:
    name = columns.get(kind, f"{kind} [unit]")
    turned = name[1:] if name.startswith("-") else f"-{name}"
    mark = "'" if '"' in turned else '"'
    return f"{kind} = {mark}{turned}{mark}"


def _jumps(jumps, frozen):
    if stands_still(frozen):  # it jumps to where it ought to be when it is read again
        return
    if jumps["against_motion"]:
        several = jumps["count"] > 1
        yield Finding(
            "error" if several else "warning",
            "angle_jumps",
            f"the angle jumps against its motion by {jumps['size_rad'] * _DEG:.4g}° "
            f"{jumps['count']} time{'s' * several}, first at sample {jumps['first_sample']}: "
            "an encoder that wraps at no full turn, or one that slips; unwrap it before it is read",
        )
    elif jumps["largest_step_rad"] > LARGEST_STEP_RAD:
        yield Finding(
            "error",
            "angle_step",
            f"the angle moves {jumps['largest_step_rad'] * _DEG:.4g}° between two samples, more than a quarter of a turn: "
            "wrong unit, or a wrap that cannot be told",
        )


def _range(found):
    moved = found["angle_signal_rad"]
    if not _LEAST_MOVED_RAD <= moved <= _MOST_MOVED_RAD:
        yield Finding(
            "warning",
            "angle_range",
            f"the angle moves {_angle_text(moved)}; with the input locked, reducers give way by {_angle_text(_LEAST_MOVED_RAD)} "
            f"to {_angle_text(_MOST_MOVED_RAD)}: wrong unit?",
        )


def _angle_text(angle_rad: float) -> str:
    degrees = _DEG * angle_rad
    return f"{degrees:.3g}°" if degrees >= 1.0 else f"{60.0 * degrees:.3g}′"
