"""`fit`: posterior, diagnostics and indicators of one unit."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.door import ready_unit
from backdrive_bayes.commands.output import default_out, require_out, say, write_folder
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import FitOptions, add_fit_arguments, fit_unit, keep_fit, keep_run, retire
from backdrive_bayes.commands.stages import FIT_KEPT
from backdrive_bayes.commands.tables import show_indicators, show_loads
from backdrive_bayes.decisions.outcome import line

HELP = "infer a unit's parameters and indicators, with credible intervals"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    add_fit_arguments(parser)
    parser.add_argument(
        "--load",
        type=float,
        action="append",
        default=[],
        metavar="NM",
        help="also say how far this load [N·m] turns the output and what energy is absorbed (repeatable)",
    )
    parser.add_argument("--load-rate", type=float, metavar="NM/S", help="rate at which they arrive (default: every measured one)")


def run(args) -> int:
    """Fit and write posterior.nc, indicators.json, run.json and figures; 0 done, 4 not to be used."""
    began, options = time.perf_counter(), FitOptions.of(args)
    ready = ready_unit(args.unit, options.k, getattr(args, "force", False))
    unit = ready.unit
    out = args.out or default_out(unit.name, "fit")
    require_out(out)
    with progress(*FIT_KEPT) as note:
        posterior, result = fit_unit(unit, options, note)
        ready.stamp(result)["notes"] += ready.lines
        with write_folder(out) as folder:
            keep_fit(posterior, result, folder, not args.no_figures, note)
            keep_run(folder, "fit", began)
            retire(out, result)
    _summarise(result, out)
    return result["outcome"]["exit_code"]


def _summarise(result: dict, out: Path) -> None:
    convergence = result["convergence"]
    say(f"{result['unit']}: {line(result['outcome'])}")
    if result["outcome"]["exit_code"]:
        least = min(convergence["min_bulk_ess"], convergence["min_tail_ess"])
        say(f"R-hat {convergence['max_rhat']:.3f}, ESS {least:.0f} ({convergence['worst']})")
    show_indicators(result)
    show_loads(result)
    say(f"written to {out}")
