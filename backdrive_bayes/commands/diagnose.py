"""`diagnose`: where model and measurement part, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.door import ready_unit
from backdrive_bayes.commands.output import default_out, require_out, say, write_folder, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import (
    DIAGNOSIS_FIGURES,
    FitOptions,
    add_fit_arguments,
    diagnose_unit,
    draw_figures,
    keep_fit,
    keep_run,
    refuse_company,
    retire,
    retire_figures,
)
from backdrive_bayes.commands.stages import DIAGNOSE, DIAGNOSE_SIMULATED
from backdrive_bayes.commands.tables import show_indicators, show_simulator, show_which
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.number_text import probability_text, share_text

HELP = "find the unmodelled effect behind the gap between model and measurement"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    what = "what a simulator answered to the same or other torque paths: say what it lacks, and what re-tuning it would close"
    parser.add_argument("--simulated", type=Path, metavar="SIM_UNIT", help=what)
    add_fit_arguments(parser)
    parser.add_argument("--no-posterior", action="store_true", help="write no posterior.nc and no indicators.json")


def run(args) -> int:
    """Diagnose and write diagnosis.json, posterior.nc of the chosen model and figures; 0 done, 4 inconclusive."""
    began, options = time.perf_counter(), FitOptions.of(args)
    ready = ready_unit(args.unit, options.k, getattr(args, "force", False))
    unit = ready.unit
    simulator = ready_unit(args.simulated, options.k, getattr(args, "force", False)) if args.simulated else None
    simulated = simulator.unit if simulator else None
    out = args.out or default_out(unit.name, "diagnose")
    require_out(out)
    with progress(*(DIAGNOSE_SIMULATED if simulated else DIAGNOSE)) as note:
        result, sampled = diagnose_unit(unit, options, note, not args.no_posterior, simulated)
    ready.beside(simulator).stamp(result)
    if sampled is None:
        refuse_company(out, result)
    else:
        ready.stamp(sampled[1])["notes"] += ready.lines
    with write_folder(out) as folder:
        write_json(folder / "diagnosis.json", result)
        keep_run(folder, "diagnose", began)
        if sampled is not None:
            posterior, indicators = sampled
            keep_fit(posterior, indicators, folder, figures=False)
        if not args.no_figures:
            draw_figures("diagnosis.json", folder)
        if sampled is not None:
            retire(out, sampled[1])
        retire_figures(out, DIAGNOSIS_FIGURES)
    _summarise(result, sampled, out)
    return result["outcome"]["exit_code"]


def _summarise(result: dict, sampled, out: Path) -> None:
    say(f"{result['unit']}: {line(result['outcome'])}")
    simulator = result.get("simulator")
    if not result["inconclusive"]:
        lead, nothing = ("missing in the simulator", "nothing that is listed") if simulator else ("answer", "no gap")
        where = f": {result['where']['summary']}" if result["answer"]["effects"] or (simulator and simulator["told"]) else ""
        say(f"a gap is there with probability {probability_text(result['gap']['probability'])}{where}")
        say(f"{lead}: {' + '.join(result['answer']['effects']).replace('_', ' ') or nothing}")
        show_which(result)
        say(f"something that is not listed acts with probability {probability_text(result['gap']['unlisted_probability'])}")
    if simulator:
        show_simulator(simulator, result["level"])
    elif not result["inconclusive"]:
        closed = result["shrink"]["closed_fraction"]
        if closed is not None and set(result["answer"]["effects"]) - {"unknown"}:
            say(f"share of the gap closed on held-out data: {share_text(closed)} (90 % interval)")
    if sampled is not None:
        show_indicators(sampled[1])
    say(f"written to {out}")
