"""`accept`: a unit against its limits, with the risks of the decision."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.door import FORCED, collected, repeat_findings
from backdrive_bayes.commands.output import default_out, require_out, say, write_folder, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import (
    FitOptions,
    add_fit_arguments,
    draw_figures,
    fit_unit,
    is_result,
    keep_fit,
    keep_run,
    ready_unit,
    stamped_by,
)
from backdrive_bayes.errors import BadInput
from backdrive_bayes.number_text import probability_text

HELP = "accept, reject or ask for more about a unit against limits, by JCGM 106:2012"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder, record file or former fit")
    parser.add_argument("--limits", type=Path, required=True, metavar="LIMITS.toml", help="limits and agreed risks")
    parser.add_argument(
        "--model",
        action="append",
        default=[],
        metavar="OUT=PROBABILITY",
        help="a further fit of the same unit under another model that stays probable (repeatable); UNIT has the rest",
    )
    parser.add_argument("--batch", type=Path, nargs="+", default=[], metavar="OUT", help="fits of other units of one process")
    add_fit_arguments(parser)


def run(args) -> int:
    """Write verdict.json and its figure, and what a new fit gives; 0 accepted, 3 rejected, 4 inconclusive."""
    from backdrive_bayes.decisions.acceptance import assess
    from backdrive_bayes.decisions.conformance import Verdict
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.decisions.limits import read_limits

    began, options, limits = time.perf_counter(), FitOptions.of(args), read_limits(args.limits)
    if args.out:
        require_out(args.out)
    others, probabilities = _models(args.model)
    batch = [Evidence.read(folder) for folder in args.batch]
    if is_result(args.unit):
        made, evidence, out = None, Evidence.read(args.unit), args.out or args.unit
        repeat_findings(evidence.name, evidence.about)
    else:
        made, evidence, out = _fit(args, limits, options)
    verdict = assess([evidence, *others], limits, probabilities, batch)
    verdict |= collected([evidence.about])
    stamped_by(verdict, [evidence, *others, *batch])
    with progress() as note, write_folder(out) as folder:
        if made:
            keep_fit(*made, folder, not args.no_figures, note)
        write_json(folder / "verdict.json", verdict)
        keep_run(folder, "accept", began)
        if not args.no_figures:
            draw_figures("save_verdict_figures", folder)
    _summarise(verdict, out)
    return Verdict(verdict["verdict"]).exit_code


def _fit(args, limits, options):
    from dataclasses import replace

    from backdrive_bayes.decisions.acceptance import limited_loops
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.decisions.loops import measured_loops

    ready = ready_unit(args.unit, options.k, getattr(args, "force", False))
    unit = ready.unit
    # A limit that no record can tell of is said before the sampling, not after it.
    told = [[r[key]["estimated"] for r in ready.checked["records"]] for key in ("loading_rate_Nm_per_s", "amplitude_Nm")]
    for limit in limits.limits:
        limited_loops(limit, measured_loops(*told))
    wanted = {limit.k for limit in limits.limits if limit.k is not None}
    if len(wanted) > 1:
        raise BadInput(args.limits, "one k for all limits on the lost motion", ", ".join(f"{k:g}" for k in sorted(wanted)))
    with progress() as note:
        posterior, result = fit_unit(unit, replace(options, k=wanted.pop()) if wanted else options, note)
    ready.stamp(result)["notes"] += ready.lines
    return (posterior, result), Evidence.of(posterior, result), args.out or default_out(unit.name, "accept")


def _models(given):
    """Evidence of further models, and the probabilities of all (None without further ones)."""
    from backdrive_bayes.decisions.evidence import Evidence

    if not given:
        return [], None
    found, probabilities = [], []
    for text in given:
        folder, _, probability = text.rpartition("=")
        try:
            probabilities.append(float(probability))
        except ValueError:
            raise BadInput("--model", "OUT=PROBABILITY", f"'{text}'") from None
        found.append(Evidence.read(Path(folder)))
    if not all(0 < p < 1 for p in probabilities) or sum(probabilities) >= 1:
        raise BadInput("--model", "probabilities above 0 that leave some for UNIT", ", ".join(f"{p:g}" for p in probabilities))
    return found, [1.0 - sum(probabilities), *probabilities]


def _summarise(verdict: dict, out: Path) -> None:
    forced = f" ({FORCED})" if verdict["forced"] else ""
    say(f"{verdict['unit']}: {verdict['verdict'].upper()}{forced}")
    say(f"  {verdict['reason']}")
    for row in verdict["limits"]:
        say(f"  {row['indicator']} at {row['loading_rate_Nm_per_s']:.3g} N·m/s, ±{row['amplitude_Nm']:.3g} N·m: {_shown(row)}")
        if row["global"]:
            found = row["global"]
            say(f"    global risks: consumer's {found['consumer']:.2g}, producer's {found['producer']:.2g}")
    if verdict["next"]:
        say(f"  next: {verdict['next']['do']}")
    say(f"written to {out}/verdict.json")


def _shown(row: dict) -> str:
    limits = ", ".join(f"{end} {row[end]:.4g}" for end in ("min", "max") if abs(row[end]) < float("inf"))
    interval = f"{row['median']:.4g} [{row['lo']:.4g}, {row['hi']:.4g}] {row['unit']}".replace(" 1", "")
    probability = probability_text(row["conformance_probability"])
    return f"{interval} ({limits}), conforms with probability {probability}: {row['verdict']}"
