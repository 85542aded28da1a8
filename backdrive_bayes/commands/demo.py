"""`demo`: the whole way on the packaged twins, ending in a PDF."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from backdrive_bayes.commands import accept, check, compare, diagnose, fit, report
from backdrive_bayes.commands.output import say
from backdrive_bayes.commands.results import BASELINE
from backdrive_bayes.errors import BadInput

HELP = "check, fit, judge, compare and diagnose the packaged twins and write one PDF"
UNITS = ("reducer-1", "reducer-2")


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("--data", type=Path, default=Path("data"), help="folder of the packaged units (default data)")


def run(args) -> int:
    """Check, fit and judge every packaged unit, compare them, diagnose the last, then the report; the worst code of the fits."""
    out = args.out or Path("reports/demo")
    if not (args.data / UNITS[0]).is_dir():
        raise BadInput(args.data, "the folder of packaged units (run from the project's folder or give --data)", "none")
    say("The packaged units are synthetic twins of published reducers, not measurements.")
    check.run(Namespace(unit=args.data / "ugly", out=out / "ugly-check", seed=args.seed))
    codes, results = [], []
    for name in UNITS:
        folder = out / name
        check.run(Namespace(unit=args.data / name, out=folder, seed=args.seed))
        defaults = {"baseline": BASELINE, "k": 0.03, "level": 0.9, "seed": args.seed, "no_figures": False}
        codes.append(fit.run(Namespace(unit=args.data / name, out=folder, **defaults)))
        limits = args.data / "limits.toml"
        accept.run(Namespace(unit=folder, out=folder, limits=limits, model=[], batch=[], **defaults))
        results.append(folder)
    both = out / "comparison"
    compare.run(Namespace(units=list(results), out=both, claims="paper", rope=0.05, **defaults))
    gap = out / f"{UNITS[-1]}-gap"
    diagnose.run(Namespace(unit=args.data / UNITS[-1], out=gap, no_posterior=True, **defaults))
    results += [both, gap]
    report.run(Namespace(results=results, out=out, seed=args.seed))
    return max(codes)
