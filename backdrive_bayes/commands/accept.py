"""`accept`: a unit against its limits, with the risks of the decision."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.door import collected, ready_unit, repeat_findings
from backdrive_bayes.commands.output import default_out, require_out, say, write_folder, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import (
    FitOptions,
    add_fit_arguments,
    diagnose_unit,
    fit_unit,
    is_result,
    keep_decision,
    keep_fit,
    keep_run,
    refuse_company,
    require_fitted_with,
    retire,
    stamped_by,
)
from backdrive_bayes.commands.stages import ACCEPT
from backdrive_bayes.commands.tables import show_indicators, show_limits
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.errors import BadInput

HELP = "accept, reject or ask for more about a unit against limits, by JCGM 106:2012; a unit is fitted and diagnosed for it"


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
    parser.add_argument("--batch", type=Path, nargs="+", default=[], metavar="OUT",
                        help="for global risks: fits of other units of one process, or one pooled batch (fleet --pool batch)")
    add_fit_arguments(parser)


def run(args) -> int:
    """Write verdict.json and its figure, and new fit and diagnosis; 0 accepted, 3 rejected, 4 inconclusive."""
    from backdrive_bayes.decisions.acceptance import assess
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.decisions.limits import read_limits

    began, options, limits = time.perf_counter(), FitOptions.of(args), read_limits(args.limits)
    if args.out:
        require_out(args.out)
    others, probabilities = _models(args.model)
    batch, batch_units = _batch(args.batch)
    with progress(*ACCEPT) as note:
        if is_result(args.unit):
            made, evidence, out = None, Evidence.read(args.unit), args.out or args.unit
            require_fitted_with(options, evidence.about)
            repeat_findings(evidence.name, evidence.about)
        else:
            made, evidence, out = _fit(args, limits, options, note)
        verdict = assess([evidence, *others], limits, probabilities, batch)
        verdict |= collected([evidence.about])
        named = {"limits": args.limits.name, "models": len(others) + 1, "batch": batch_units}
        stamped_by(verdict, [evidence], **named)
        if not made:
            verdict["posterior_sha256"] = evidence.about["posterior_sha256"]
            refuse_company(out, verdict)
        with write_folder(out) as folder:
            if made:
                write_json(folder / "diagnosis.json", evidence.diagnosis)
                posterior, indicators = made
                verdict["posterior_sha256"] = keep_fit(posterior, indicators, folder, not args.no_figures, note)
                retire(out, indicators)
            keep_decision(verdict, "verdict.json", out, folder, not args.no_figures)
            keep_run(folder, "accept", began)
    _summarise(verdict, evidence.about, out)
    return verdict["outcome"]["exit_code"]


def _fit(args, limits, options, note):
    """Fit and diagnosis of a unit: posterior and indicators object, the evidence that they are, and where to write."""
    from dataclasses import replace

    from backdrive_bayes.decisions.acceptance import limited_loops
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.decisions.loops import measured_loops
    from backdrive_bayes.engine.infer import record_facts
    from backdrive_bayes.engine.reduced import reduce_unit

    ready = ready_unit(args.unit, options.k, getattr(args, "force", False))
    unit = ready.unit
    # A limit that no record can tell of is said before the sampling, not after it.
    facts = record_facts(reduce_unit(unit))
    for limit in limits.limits:
        limited_loops(limit, measured_loops(facts.rate_nm_per_s, facts.amplitude_nm))
    k = limits.only_k(args.limits) or options.k
    if options.k not in (FitOptions.k, k):
        raise BadInput("--k", f"{k:g} as in {args.limits.name}", options.k)
    options = replace(options, k=k)
    posterior, result = fit_unit(unit, options, note)
    # What acts beside the model would shift every number that is judged.
    diagnosis, _ = diagnose_unit(unit, options, note, sample=False)
    ready.stamp(result)["notes"] += ready.lines
    evidence = replace(Evidence.of(posterior, result), diagnosis=ready.stamp(diagnosis))
    return (posterior, result), evidence, args.out or default_out(unit.name, "accept")


def _batch(folders: list[Path]):
    """A pooled batch, or evidence of other units; and the names of the units."""
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.decisions.pool import NAME, Pool

    pooled = [folder for folder in folders if (folder / NAME).is_file()]
    if not pooled:
        found = [Evidence.read(folder) for folder in folders]
        return found, [other.name for other in found]
    if len(folders) > 1:
        raise BadInput("--batch", "one pooled batch, or fits of other units", f"{len(folders)} folders, '{pooled[0]}' among them")
    pool = Pool.read(pooled[0])
    return pool, pool.about["units"]


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


def _summarise(verdict: dict, indicators: dict, out: Path) -> None:
    say(f"{verdict['unit']}: {line(verdict['outcome'])}")
    show_indicators(indicators)
    show_limits(verdict)
    if verdict["next"]:
        say(f"next: {verdict['next']['do']}")
    say(f"written to {out}/verdict.json")
