"""`diagnose`: where model and measurement part, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.output import default_out, require_out, say, write_folder, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import (
    FitOptions,
    add_fit_arguments,
    diagnose_unit,
    draw_figures,
    keep_fit,
    keep_run,
    ready_unit,
)

HELP = "find the unmodelled effect behind the gap between model and measurement"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    add_fit_arguments(parser)
    parser.add_argument("--no-posterior", action="store_true", help="write diagnosis.json only, sample nothing")


def run(args) -> int:
    """Diagnose and write diagnosis.json, posterior.nc of the chosen model and figures; 0 done, 4 inconclusive."""
    began, options = time.perf_counter(), FitOptions.of(args)
    ready = ready_unit(args.unit, options.k, getattr(args, "force", False))
    unit = ready.unit
    out = args.out or default_out(unit.name, "diagnose")
    require_out(out)
    with progress() as note:
        result, sampled = diagnose_unit(unit, options, note, not args.no_posterior)
    ready.stamp(result)
    if sampled is not None:
        ready.stamp(sampled[1])
    with write_folder(out) as folder:
        write_json(folder / "diagnosis.json", result)
        keep_run(folder, "diagnose", began)
        if sampled is not None:
            keep_fit(*sampled, folder, figures=False)
        if not args.no_figures:
            draw_figures("save_figures", folder)
    _summarise(result, out)
    return 4 if result["inconclusive"] else 0


def _summarise(result: dict, out: Path) -> None:
    if result["inconclusive"]:
        say(f"{result['unit']}: INCONCLUSIVE, {result['inconclusive']}")
    else:
        top = ", ".join(f"{row['effect']} {row['probability']:.2f}" for row in result["which"][:3])
        say(f"{result['unit']}: gap with probability {result['gap']['probability']:.2f}; {top}")
        named, chosen = " + ".join(result["answer"]["effects"]) or "none", ", ".join(result["answer"]["credible_set_90"])
        say(f"  answer: {named}; 90 % set: {chosen}")
        if named != "unknown":
            say(f"  something that is not listed acts with probability {result['gap']['unlisted_probability']:.2f}")
        say(f"  where: {result['where']['summary']}")
        closed = result["shrink"]["closed_fraction"]
        say(f"  closed on data left out: {closed['median']:.0%} [{closed['lo']:.0%}, {closed['hi']:.0%}] (90 %)")
    say(f"written to {out}")
