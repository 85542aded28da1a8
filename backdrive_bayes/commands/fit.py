"""`fit`: posterior, diagnostics and indicators of one unit."""

from __future__ import annotations

from pathlib import Path

from backdrive_bayes.commands.output import default_out, progress, say, write_folder, write_json
from backdrive_bayes.errors import BadInput, MissingExtra

CHAIN = "chain.h5"
ARCMIN = 10800.0 / 3.141592653589793
HELP = "infer a unit's parameters and indicators, with credible intervals"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("unit", type=Path, metavar="UNIT", help="unit folder or a bare record file")
    parser.add_argument("--baseline", default="geometric,elastic,friction", help="modules of the model, comma-separated")
    parser.add_argument("--k", type=float, default=0.03, help="share of T_r at which lost motion is taken (default 0.03)")
    parser.add_argument("--level", type=float, default=0.9, help="level of the central intervals (default 0.9)")
    parser.add_argument("--budget", type=float, default=120.0, metavar="SECONDS", help="stop sampling after this time")
    parser.add_argument("--resume", action="store_true", help="go on with the fit in OUT whose budget ran out")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")


def run(args) -> int:
    """Fit and write posterior.nc, indicators.json and figures; 0 done, 4 not converged, then with chain.h5 to resume from."""
    from backdrive_bayes.indicators.least_squares import least_squares_json
    from backdrive_bayes.indicators.summary import indicators_json, monitored
    from backdrive_bayes.inference.chain_file import read_chain, write_chain
    from backdrive_bayes.inference.fit import fit
    from backdrive_bayes.inference.posterior_file import write_posterior
    from backdrive_bayes.inference.sampling import Settings
    from backdrive_bayes.records.check import check_unit
    from backdrive_bayes.records.faults import without_wild
    from backdrive_bayes.records.unit_folder import read_unit

    for name, value, top in (("--k", args.k, 1.0), ("--level", args.level, 1.0), ("--budget", args.budget, 1e7)):
        if not 0 < value < top:
            raise BadInput(name, f"a number between 0 and {top:g}", value)
    unit = without_wild(read_unit(args.unit))
    faults = [m["text"] for m in check_unit(unit)["messages"] if m["level"] != "info"]
    for fault in faults:
        say(f"warning: {fault}")
    baseline = tuple(args.baseline.split(","))
    out = args.out or default_out(unit.name, "fit")
    resume = read_chain(out / CHAIN, unit, baseline, args.seed) if args.resume else None
    with progress() as note:
        posterior = fit(
            unit,
            baseline=baseline,
            seed=args.seed,
            settings=Settings(max_seconds=args.budget),
            quantities=monitored(args.k),
            resume=resume,
            progress=note,
        )
    result = indicators_json(posterior, args.k, args.level)
    for record, own in zip(result["records"], unit.records, strict=True):
        record["least_squares"] = least_squares_json(own, unit.rated_torque_nm, args.k)
    result["identity"] = dict(unit.identity)
    result["notes"] = [*unit.notes, *(f"{r.name}: {note}" for r in unit.records for note in r.notes), *faults]
    with write_folder(out) as folder:
        write_json(folder / "indicators.json", result)
        write_posterior(posterior, folder / "posterior.nc")
        if not args.no_figures:
            _draw(folder)
        if not posterior.converged:
            write_chain(posterior, folder / CHAIN)
    if posterior.converged:
        (out / CHAIN).unlink(missing_ok=True)
    _summarise(result, out)
    return 0 if posterior.converged else 4


def _draw(folder: Path) -> None:
    try:
        from backdrive_bayes.figures.catalogue import save_figures
    except MissingExtra as missing:
        say(f"no figures: {missing}")
    else:
        save_figures(folder, folder / "figures")


def _summarise(result: dict, out: Path) -> None:
    convergence = result["convergence"]
    if not convergence["converged"]:
        least = min(convergence["min_bulk_ess"], convergence["min_tail_ess"])
        say(f"{result['unit']}: INCONCLUSIVE, {convergence['advice']}")
        say(f"  worst: {convergence['worst']}; R-hat {convergence['max_rhat']:.3f}, ESS {least:.0f}")
    else:
        say(f"{result['unit']}: converged in {convergence['seconds']:.1f} s; median [{result['level']:.0%} interval]")
        for record in result["records"]:
            say(f"  {record['file']}: " + ", ".join(_shown(record["indicators"], result["k"])))
    say(f"written to {out}")


def _shown(indicators: dict, k: float):
    names = (
        ("lost_motion_rad", f"δ({k:g}T_r)", ARCMIN, "′"),
        ("zero_torque_width_rad", "w(0)", ARCMIN, "′"),
        ("peak_angle_rad", "peak", ARCMIN, "′"),
        ("loop_area_J", "S", 1e3, " mJ"),
        ("dissipation_ratio", "u", 1.0, ""),
    )
    for key, symbol, factor, unit in names:
        value = indicators[key]
        if value is not None:
            median, lo, hi = (value[part] * factor for part in ("median", "lo", "hi"))
            yield f"{symbol} = {median:.4g} [{lo:.4g}, {hi:.4g}]{unit}"
