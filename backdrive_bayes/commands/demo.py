"""`demo`: the whole way on the packaged twins, ending in a PDF."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

from backdrive_bayes.commands import accept, check, compare, diagnose, fit, fleet, report
from backdrive_bayes.commands.output import say
from backdrive_bayes.commands.results import BASELINE
from backdrive_bayes.errors import BadInput, MissingExtra

HELP = "check, fit, diagnose, judge and compare the packaged twins and write one PDF, then evaluate the packaged fleet"
UNITS = ("reducer-1", "reducer-2")
PACKAGED = (Path(__file__).parents[1] / "data").resolve()


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("--data", type=Path, default=PACKAGED, help="folder of the units (default: those of the package)")
    parser.add_argument("--fleet", action="store_true", help="fit the packaged fleet of twelve small units alone")


def run(args) -> int:
    """Check, fit, diagnose and judge every packaged unit, compare them, then the report, and the packaged fleet with its own.

    With ``args.fleet`` the fleet alone. Returns the worst code of the fits and the fleet.
    """
    out = args.out or Path("reports/demo/fleet" if args.fleet else "reports/demo")
    if not (args.data / UNITS[0]).is_dir():
        raise BadInput(args.data, f"a folder with the units {' and '.join(UNITS)}", "none")
    if args.fleet:
        return _fleet(args.data / "fleet", out, args.seed)
    say("The packaged units are synthetic twins of published reducers, not measurements.")
    shared = {"baseline": BASELINE, "k": 0.03, "level": 0.9, "seed": args.seed, "no_figures": False, "force": False}
    _call(check, [args.data / "ugly"], out=out / "ugly-check", **shared)
    codes, results = [], [out / name for name in UNITS]
    for name, folder in zip(UNITS, results, strict=True):
        unit = args.data / name
        _call(check, [unit], out=folder, **shared)
        codes.append(_call(fit, [unit], out=folder, **shared))
        # A verdict rests on the diagnosis that lies beside the fit: structure counts.
        _call(diagnose, [unit, "--no-posterior"], out=folder, **shared)
        _call(accept, [folder, "--limits", args.data / "limits.toml"], out=folder, **shared)
    both = out / "comparison"
    _call(compare, [*results, "--claims", "paper"], out=both, **shared)
    _call(report, [*results, both], out=out, **shared)
    try:
        codes.append(_fleet(args.data / "fleet", out / "fleet", args.seed))
    except MissingExtra as missing:
        say(f"no fleet: {missing}")
    return max(codes)


def _fleet(folder: Path, out: Path, seed: int) -> int:
    say("The packaged fleet is synthetic, of the model's own class: it shows the evaluation of many units and tests no model.")
    code = _call(fleet, [folder], out=out, seed=seed)
    _call(report, [out], out=out, seed=seed)
    return code


def _call(verb, words, **shared) -> int:
    """Run a verb as its command line does, all that is not given at the verb's own defaults."""
    options = ArgumentParser()
    verb.add_arguments(options)
    return verb.run(options.parse_args([str(w) for w in words], Namespace(**shared)))
