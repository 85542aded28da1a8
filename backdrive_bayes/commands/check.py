"""`check`: read a unit's records and judge them."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.commands.output import complain, default_out, say, write_folder, write_json
from backdrive_bayes.commands.results import origin, stamped
from backdrive_bayes.number_text import ARCMIN_PER_RAD, with_error

HELP = "read and judge a unit's records: samples, branches, cycles, closure, noise"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")


def run(args) -> int:
    """Write check.json and show what it says; 0, or 2 where an error speaks against inference."""
    from backdrive_bayes.records.check import LOST_MOTION_SHARE, check_unit
    from backdrive_bayes.records.unit_folder import read_unit

    unit = read_unit(args.unit)
    result = stamped(check_unit(unit), origin(unit), args.seed, {"k": LOST_MOTION_SHARE})
    out = args.out or default_out(unit.name, "check")
    with write_folder(out) as folder:
        write_json(folder / "check.json", result)
    _summarise(result)
    say(f"written to {out}/check.json")
    if result["outcome"]["exit_code"]:
        complain(f"{args.unit}: expected data fit for inference, found {result['outcome']['reason']}")
    return result["outcome"]["exit_code"]


def _summarise(result: dict) -> None:
    say(f"{result['unit']}: rated torque {result['rated_torque_Nm']:.4g} N·m")
    for record in result["records"]:
        say(f"  {record['record']}: {_extent(record)}")
        say(f"    {_levels(record['noise'])}{_closure(record)}")
        if record["measured_loop"]:
            say(f"    {_measured(record['measured_loop'])}")
    for finding in result["findings"]:
        where = f"{finding['record']}: " if finding["record"] else ""
        say(f"  {finding['level']}: {where}{finding['text']}")
    outcome = result["outcome"]
    errors = sum(finding["level"] == "error" for finding in result["findings"])
    why = f"{errors} error{'s'[: errors != 1]}" if errors else outcome["reason"]
    say(f"{outcome['word'].upper()}, inference {'should not' if outcome['exit_code'] else 'may'} go on: {why}")


def _extent(record: dict) -> str:
    amplitude = record["amplitude_Nm"]["estimated"]
    rate = record["loading_rate_Nm_per_s"]["estimated"]
    cycles = record["cycles"]
    size = f"{record['samples']} samples in {record['duration_s']:.4g} s"
    torque = f"±{amplitude:.4g} N·m at {rate:.4g} N·m/s"
    return f"{size}, {torque}, {len(record['branches'])} branches, {cycles} cycle{'s'[: cycles != 1]}"


def _levels(noise: dict) -> str:
    correlated = f"{noise['correlated_rad'] * ARCMIN_PER_RAD:.2g}′ over {noise['correlation_time_s'] * 1e3:.3g} ms"
    return (
        f"angle noise {noise['white_rad'] * ARCMIN_PER_RAD:.2g}′ white, {correlated}; "
        f"torque noise {noise['torque_Nm']:.2g} N·m"
    )


def _measured(loop: dict) -> str:
    width = loop["zero_torque_width_rad"]
    parts = [
        f"∮τ dθ = {with_error(loop['loop_area_J'] * 1e3, loop['loop_area_J_sd'] * 1e3)} mJ",
        _angle("half peak to peak", loop, "half_peak_to_peak_rad"),
        *([] if width is None else [_angle("w(0)", loop, "zero_torque_width_rad")]),
    ]
    return f"measured {loop['basis']} cycle: {', '.join(parts)}"


def _angle(name: str, loop: dict, key: str) -> str:
    return f"{name} = {with_error(loop[key] * ARCMIN_PER_RAD, loop[f'{key}_sd'] * ARCMIN_PER_RAD, '′')}"


def _closure(record: dict) -> str:
    closure = record["closure"]
    if closure is None:
        return ""
    return f"; loop closes to {with_error(closure['difference_rad'] * ARCMIN_PER_RAD, closure['sd_rad'] * ARCMIN_PER_RAD, '′')}"
