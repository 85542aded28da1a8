"""`blind`: units with a withheld effect, diagnosed without the key, then scored."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

from backdrive_bayes.blind.seal import UNITS
from backdrive_bayes.commands.output import say, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import draw_figures, keep_run, stamped
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.errors import BadInput

HELP = "make units with a withheld effect, diagnose them without the key, then open the key and score"
NAME = "blind.json"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("--units", type=int, default=40, metavar="N", help="how many units (default 40)")
    parser.add_argument("--severities", default="1,0.4,0.2,0.1", metavar="S,…", help="severities (default 1,0.4,0.2,0.1)")
    parser.add_argument("--effects", metavar="NAME,…", help="classes to draw from: effects, none, unknown, pair (default: all)")
    parser.add_argument("--reserved", action="store_true", help="unlisted effects from the reserved group")
    parser.add_argument("--plan", default="rates", help="records of a unit: rates (three, the default), random, or quick")
    parser.add_argument("--dirt", type=float, default=1.0, metavar="LEVEL", help="small faults of every bench (default 1)")
    parser.add_argument(
        "--oracle", type=int, metavar="M", help="units given to an oracle that knows the effect (default: a fifth)"
    )
    parser.add_argument(
        "--removed", type=int, metavar="M", help="units asked again without their effect in the library (likewise)"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="W", help="processes (default: one a core)")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")


def run(args) -> int:
    """Carry out the check, resuming what OUT holds of it, and write blind.json and figures."""
    from backdrive_bayes.blind.diagnosing import diagnose_folder
    from backdrive_bayes.blind.study import Study, run_study

    began, request, out = time.perf_counter(), _request(args), args.out or Path("blind")
    again = [_count(name, value, args.units) for name, value in (("--oracle", args.oracle), ("--removed", args.removed))]
    if args.workers < 1:
        raise BadInput("--workers", "a number from 1", args.workers)
    with progress() as note:
        result = run_study(Study(request, out, diagnose_folder, write_json, again[0], again[1], args.workers, note))
    stamped(result, {"unit": "blind", "data_sha256": _data_sha256(out)}, args.seed, result["request"])
    write_json(out / NAME, result)
    if not args.no_figures:
        draw_figures("blind.json", out)
    keep_run(out, "blind", began)
    _summarise(result, out)
    return result["outcome"]["exit_code"]


def _data_sha256(out: Path) -> list[str]:
    """SHA-256 of every record in the order of units and records."""
    from backdrive_bayes.records.unit_folder import sha256_of

    files = (f for f in sorted((out / UNITS).rglob("*")) if f.is_file() and f.suffix != ".toml")
    return [sha256_of(f) for f in files]


def _request(args):
    from backdrive_bayes.blind.request import CLASSES, Request

    classes = CLASSES if args.effects is None else tuple(args.effects.split(","))
    try:
        severities = tuple(float(word) for word in args.severities.split(","))
    except ValueError:
        raise BadInput("--severities", "numbers separated by commas", f"'{args.severities}'") from None
    if not (math.isfinite(args.dirt) and 0.0 <= args.dirt <= 10.0):
        raise BadInput("--dirt", "a number from 0 to 10", args.dirt)
    return Request(args.units, severities, classes, args.reserved, args.plan, args.dirt, args.seed)


def _count(option, value, units):
    if value is None:
        return units // 5
    if not 0 <= value <= units:
        raise BadInput(option, "a number from 0 to that of the units", value)
    return value


def _summarise(result: dict, out: Path) -> None:
    say(line(result["outcome"]))
    counts = result["counts"]
    say(f"{counts['units']} units diagnosed, {counts['failed']} without an answer; key {result['key_sha256'][:12]}…")
    for failure in result["failures"][:5]:
        say(f"  {failure['unit']}: {failure['error']}")
    for mark in result["marks"]:
        verdict = {True: "met", False: "MISSED", None: "nothing to score"}[mark["met"]]
        found = "–" if mark["found"] is None else f"{mark['found']:.3g}"
        bound = f"≥ {mark['least']:g}" if mark["least"] is not None else f"≤ {mark['most']:g}"
        say(f"  {mark['mark']}: {found} (wanted {bound}), {verdict}")
    say(f"written to {out}")
