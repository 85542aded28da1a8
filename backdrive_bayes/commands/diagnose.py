"""`diagnose`: where model and measurement part, which effect causes it, how far the gap shrinks."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.commands.output import default_out, progress, say, write_folder, write_json
from backdrive_bayes.commands.results import FitOptions, draw_figures, fit_unit, keep_fit, ready_unit
from backdrive_bayes.errors import BadInput

HELP = "find the unmodelled effect behind the gap between model and measurement"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    parser.add_argument("--baseline", default="geometric,elastic,friction", help="modules taken for granted, comma-separated")
    parser.add_argument("--k", type=float, default=0.03, help="share of T_r at which lost motion is taken (default 0.03)")
    parser.add_argument("--budget", type=float, default=30.0, metavar="SECONDS", help="time for sampling the chosen model")
    parser.add_argument("--no-posterior", action="store_true", help="write diagnosis.json only, sample nothing")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")


def run(args) -> int:
    """Diagnose and write diagnosis.json, posterior.nc of the chosen model and figures; 0 done, 4 inconclusive."""
    from backdrive_bayes.gap.diagnose import diagnose

    for name, value, top in (("--k", args.k, 1.0), ("--budget", args.budget, 1e7)):
        if not 0 < value < top:
            raise BadInput(name, f"a number between 0 and {top:g}", value)
    (unit, _), baseline = ready_unit(args.unit), tuple(args.baseline.split(","))
    with progress() as note:
        found = diagnose(unit, baseline=baseline, seed=args.seed, k=args.k, progress=note)
        sampled = None if args.no_posterior else _sample(unit, baseline, found, args, note)
    result = found.json
    if sampled is not None:
        result["convergence"] = sampled[0].convergence.to_json()
    out = args.out or default_out(unit.name, "diagnose")
    with write_folder(out) as folder:
        write_json(folder / "diagnosis.json", result)
        if sampled is not None:
            keep_fit(*sampled, folder, figures=False)
        if not args.no_figures:
            draw_figures("save_figures", folder)
    _summarise(result, out)
    return 4 if result["inconclusive"] else 0


def _sample(unit, baseline, found, args, note):
    """The model with what was named, sampled: posterior and indicators object."""
    model = (*baseline, *(e for e in found.effects if e not in baseline))
    return fit_unit(unit, FitOptions(model, k=args.k, seconds=args.budget, seed=args.seed), note)


def _summarise(result: dict, out: Path) -> None:
    if result["inconclusive"]:
        say(f"{result['unit']}: INCONCLUSIVE, {result['inconclusive']}")
    else:
        top = ", ".join(f"{row['effect']} {row['probability']:.2f}" for row in result["which"][:3])
        say(f"{result['unit']}: gap with probability {result['gap']['probability']:.2f}; {top}")
        named, chosen = " + ".join(result["answer"]["effects"]) or "none", ", ".join(result["answer"]["credible_set_90"])
        say(f"  answer: {named}; 90 % set: {chosen}")
        say(f"  where: {result['where']['summary']}")
        closed = result["shrink"]["closed_fraction"]
        say(f"  closed on data left out: {closed['median']:.0%} [{closed['lo']:.0%}, {closed['hi']:.0%}] (90 %)")
    say(f"written to {out}")
