"""`compare`: differences of units at matched rate and amplitude, and claims with probabilities."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.door import collected, ready_unit, repeat_findings
from backdrive_bayes.commands.output import default_out, require_out, say, write_folder
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import (
    FitOptions,
    add_fit_arguments,
    fit_unit,
    is_result,
    keep_decision,
    keep_fit,
    keep_run,
    require_fitted_with,
    stamped_by,
)
from backdrive_bayes.commands.stages import FIT
from backdrive_bayes.commands.tables import show_claims, show_pair
from backdrive_bayes.decisions.outcome import line
from backdrive_bayes.errors import BadInput

HELP = "differences of units with intervals, and the probability of claims about them"


def add_arguments(parser) -> None:
    """Options of this verb."""
    what = "two or more unit folders, record files or former fits"
    parser.add_argument("units", type=Path, nargs="+", metavar="UNIT", help=what)
    parser.add_argument("--claims", metavar="FILE|paper", help="claims to be answered: a TOML file, or the published ones")
    parser.add_argument(
        "--rope", type=float, default=0.05, metavar="SHARE", help="relative difference that counts as none (default 0.05)"
    )
    add_fit_arguments(parser)


def run(args) -> int:
    """Write comparison.json and figures, and what new fits give; 0 done, 4 where a unit did not converge."""
    from backdrive_bayes.decisions.claims import read_claims
    from backdrive_bayes.decisions.comparison import compare, require_rope

    began, options = time.perf_counter(), FitOptions.of(args)
    if len(args.units) < 2:
        raise BadInput("compare", "two units or more", "one")
    require_rope(args.rope)
    if args.out:
        require_out(args.out)
    claims = read_claims(args.claims) if args.claims else None
    evidences, made = _evidences(args, options)
    result = compare(evidences, claims, args.rope, args.level, args.seed)
    result |= collected([e.about for e in evidences])
    stamped_by(result, evidences, args.seed, level=args.level, rope=args.rope, claims=Path(args.claims or "").name)
    out = args.out or default_out("-".join(result["names"][:3]), "compare")
    with progress() as note, write_folder(out) as folder:
        for name, (posterior, own) in made.items():
            (folder / name).mkdir()
            keep_fit(posterior, own, folder / name, not args.no_figures, note)
        keep_decision(result, "comparison.json", out, folder, not args.no_figures)
        keep_run(folder, "compare", began)
    _summarise(result, out)
    return result["outcome"]["exit_code"]


def _evidences(args, options):
    """Evidence of every unit in order, and the new fits by the name of their folder."""
    from backdrive_bayes.decisions.comparison import require_own_records
    from backdrive_bayes.decisions.evidence import Evidence

    # Whatever cannot be read is said before the first unit is sampled.
    force = getattr(args, "force", False)
    units = [Evidence.read(path) if is_result(path) else ready_unit(path, options.k, force) for path in args.units]
    hashes = (u.unit.data_sha256 if hasattr(u, "unit") else u.about["data_sha256"] for u in units)
    require_own_records(zip(args.units, hashes, strict=True))
    evidences, made = [], {}
    for ready in units:
        if isinstance(ready, Evidence):
            require_fitted_with(options, ready.about, ("baseline", "k"))
            repeat_findings(ready.name, ready.about)
            evidences.append(ready)
            continue
        unit = ready.unit
        with progress(*FIT) as note:
            posterior, result = fit_unit(unit, options, lambda text, name=unit.name, note=note: note(f"{name}: {text}"))
        ready.stamp(result)["notes"] += ready.lines
        evidences.append(Evidence.of(posterior, result))
        name = default_out(unit.name, "fit").name
        made[name if name not in made else f"{name}-{len(made) + 1}"] = posterior, result
    return evidences, made


def _summarise(result: dict, out: Path) -> None:
    say(line(result["outcome"]))
    for pair in result["pairs"]:
        show_pair(pair, result["level"])
    if result["claims"]:
        show_claims(result["claims"]["claims"])
    say(f"written to {out}/comparison.json")
