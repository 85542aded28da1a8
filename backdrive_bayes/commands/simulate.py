"""`simulate`: virtual bench records of a reducer with any effects."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from backdrive_bayes.bench.benches import BENCHES, DEFAULT_BENCH
from backdrive_bayes.bench.registry import EFFECTS, NONE, UNKNOWN
from backdrive_bayes.commands.output import say, write_folder, write_json
from backdrive_bayes.errors import BadInput

HELP = "make the records of a virtual bench: a reducer with any effects, as a unit folder"
SEVERITIES = {
    "1": "8 to 15 noise sds more than the parameters absorb (default)",
    "0.4": "clear",
    "0.2": "weak",
    "0.1": "hardly to be seen",
    "0": "not there",
}
"""Severities, which are any number from 0 to 10, and what they look like (see bench/severity.py)."""
MOST_SAMPLES = 5_000_000


def add_arguments(parser) -> None:
    """Options of this verb."""
    what = "effect, and its severity (default 1); repeatable. Both are listed below"
    parser.add_argument("--effect", action="append", default=[], metavar="NAME[=SEVERITY]", help=what)
    benches = ", ".join(BENCHES)
    parser.add_argument("--bench", default=DEFAULT_BENCH, metavar="NAME", help=f"mechanics: {benches} (default {DEFAULT_BENCH})")
    rates = "loading rates in rated torques per second (default 0.1,0.5,1)"
    parser.add_argument("--rates", default="0.1,0.5,1", metavar="R,…", help=rates)
    parser.add_argument("--amplitudes", default="1", metavar="A,…", help="amplitudes as shares of the rated torque (default 1)")
    parser.add_argument("--cycles", default="1", metavar="N", help="cycles of each record (default 1)")
    parser.add_argument("--hertz", default="1000", metavar="F", help="sampling frequency in hertz (default 1000)")
    parser.add_argument("--kind", metavar="KIND", help="one of the bench's kinds of reducer (default: at random)")
    parser.add_argument("--soil", default="1", metavar="LEVEL", help="small faults of every bench (default 1, 0 is none)")
    parser.add_argument("--truth", type=Path, metavar="FILE", help="also write the truth, to this file outside OUT")
    parser.formatter_class, parser.epilog = argparse.RawDescriptionHelpFormatter, _lists()


def _lists() -> str:
    """Effects and severities, a line each."""
    effects = EFFECTS | {UNKNOWN: "one that no library lists, drawn at random", NONE: "a clean reducer (default)"}
    blocks = {"effects": effects, "severities (any number from 0 to 10)": SEVERITIES}
    lines = [[f"{title}:", *(f"  {name:<25} {words}" for name, words in rows.items())] for title, rows in blocks.items()]
    return "\n\n".join("\n".join(block) for block in lines)


def run(args) -> int:
    """Write a unit folder, and the truth where asked."""
    import numpy as np

    from backdrive_bayes.bench.severity import FULL
    from backdrive_bayes.bench.unit import draw_unit
    from backdrive_bayes.bench.writing import truth_json, write_unit

    plan, out = _plan(args), args.out or Path("bench-unit")
    _refuse_inside(args.truth, out)
    if args.truth:
        args.truth.parent.mkdir(parents=True, exist_ok=True)
    soil = _numbers("--soil", args.soil, 0.0, 10.0, one=True)[0]
    rng, name = np.random.default_rng(args.seed), f"bench-unit-{args.seed}"
    bench = draw_unit(rng, _effects(args.effect), bench=args.bench, plan=plan, kind=args.kind, soil=soil, name=name)
    with write_folder(out) as folder:
        write_unit(bench, folder)
    if args.truth:
        write_json(args.truth, truth_json(bench))
    for planted in (p for p in bench.truth.planted if p.limited):
        wanted = planted.severity * FULL[0]
        say(f"{planted.name} stands out by {planted.height:.2g} noise sds here, of {wanted:.2g} or more that were asked for")
    say(f"written to {out}: {len(plan.loops)} records, rated torque {bench.unit.rated_torque_nm:.4g} N·m")
    return 0


def _plan(args):
    from backdrive_bayes.bench.plan import make_plan

    rates = _numbers("--rates", args.rates, 1e-4, 100.0)
    amplitudes = _numbers("--amplitudes", args.amplitudes, 0.01, 3.0)
    cycles = _numbers("--cycles", args.cycles, 1, 1000, one=True)[0]
    hertz = _numbers("--hertz", args.hertz, 10.0, 10000.0, one=True)[0]
    if cycles != int(cycles):
        raise BadInput("--cycles", "a whole number", args.cycles)
    plan = make_plan(rates, amplitudes, int(cycles), hertz)
    samples = [(4 * cycles + 1) * loop.amplitude / loop.rate * hertz for loop in plan.loops]
    if sum(samples) > MOST_SAMPLES or min(samples) < 200:
        asked = f"{min(samples):.0f} in the shortest, {sum(samples):.0f} in all"
        raise BadInput("samples of the records", f"200 in each and at most {MOST_SAMPLES} in all", asked)
    return plan


def _effects(words) -> dict[str, float]:
    effects = {}
    for word in words:
        name, given, severity = word.partition("=")
        if name in effects:
            raise BadInput("--effect", "each effect once", f"'{name}' twice")
        effects[name] = _numbers(f"--effect {name}", severity, 0.0, 10.0, one=True)[0] if given else 1.0
    return effects


def _numbers(option, text, low, high, one=False) -> tuple[float, ...]:
    wanted = f"{'a number' if one else 'numbers'} from {low:g} to {high:g}"
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        raise BadInput(option, wanted, f"'{text}'") from None
    if not all(math.isfinite(v) and low <= v <= high for v in values) or (one and len(values) > 1):
        raise BadInput(option, wanted, f"'{text}'")
    return values


def _refuse_inside(truth: Path | None, out: Path) -> None:
    if truth is None:
        return
    if truth.is_dir():
        raise BadInput("--truth", "a file to write", f"the folder '{truth}'")
    if truth.resolve().is_relative_to(out.resolve()):
        raise BadInput("--truth", f"a file outside {out}", f"'{truth}'")
