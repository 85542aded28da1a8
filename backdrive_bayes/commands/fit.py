"""`fit`: posterior, diagnostics and indicators of one unit."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.commands.output import progress, say, write_folder, write_json
from backdrive_bayes.errors import BadInput

HELP = "infer a unit's parameters and indicators, with credible intervals"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    parser.add_argument("--baseline", default="geometric,elastic,friction", help="modules of the model, comma-separated")
    parser.add_argument("--k", type=float, default=0.03, help="share of T_r at which lost motion is taken (default 0.03)")
    parser.add_argument("--level", type=float, default=0.9, help="level of the central intervals (default 0.9)")
    parser.add_argument("--budget", type=float, default=120.0, metavar="SECONDS", help="stop sampling after this time")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")


def run(args) -> int:
    """Fit and write posterior.nc, indicators.json and figures; 0 done, 4 not converged."""
    from backdrive_bayes.indicators.least_squares import least_squares_json
    from backdrive_bayes.indicators.summary import indicators_json, monitored
    from backdrive_bayes.inference.fit import fit
    from backdrive_bayes.inference.posterior_file import write_posterior
    from backdrive_bayes.inference.sampling import Settings
    from backdrive_bayes.records.unit_folder import read_unit

    for name, value, top in (("--k", args.k, 1.0), ("--level", args.level, 1.0), ("--budget", args.budget, 1e7)):
        if not 0 < value < top:
            raise BadInput(name, f"a number between 0 and {top:g}", value)
    unit = read_unit(args.unit)
    with progress() as note:
        posterior = fit(
            unit,
            baseline=tuple(args.baseline.split(",")),
            seed=args.seed,
            settings=Settings(max_seconds=args.budget),
            quantities=monitored(args.k),
            progress=note,
        )
    result = indicators_json(posterior, args.k, args.level)
    for record, own in zip(result["records"], unit.records, strict=True):
        record["least_squares"] = least_squares_json(own, unit.rated_torque_nm, args.k)
    with write_folder(args.out or Path(f"{unit.name}-fit")) as folder:
        write_json(folder / "indicators.json", result)
        write_posterior(posterior, folder / "posterior.nc")
    _summarise(result)
    return 0 if posterior.converged else 4
