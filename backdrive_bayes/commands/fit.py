"""`fit`: posterior, diagnostics and indicators of one unit."""

from __future__ import annotations

import time
from pathlib import Path

from backdrive_bayes.commands.output import default_out, require_out, say, write_folder
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import FitOptions, add_fit_arguments, fit_unit, keep_fit, keep_run, ready_unit, retire

ARCMIN = 10800.0 / 3.141592653589793
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
    with progress() as note:
        posterior, result = fit_unit(unit, options, note)
        ready.stamp(result)["notes"] += ready.lines
        with write_folder(out) as folder:
            keep_fit(posterior, result, folder, not args.no_figures, note)
            keep_run(folder, "fit", began)
    retire(out, result["data_sha256"])
    _summarise(result, out)
    return 0 if posterior.converged else 4


def _summarise(result: dict, out: Path) -> None:
    convergence = result["convergence"]
    if convergence["converged"]:
        say(f"{result['unit']}: converged; median [{result['level']:.0%} interval]")
    else:
        least = min(convergence["min_bulk_ess"], convergence["min_tail_ess"])
        say(f"{result['unit']}: INCONCLUSIVE, {convergence['advice']}")
        for text in convergence["contradictions"][1:]:
            say(f"  and {text}")
        say(f"  R-hat {convergence['max_rhat']:.3f}, ESS {least:.0f} ({convergence['worst']}); provisional median [interval]:")
    for record in result["records"]:
        say(f"  {record['file']}: " + ", ".join(_shown(record["indicators"], result["k"])))
    for row in result.get("loads", []):
        say(f"  {_load_text(row)}")
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
            yield f"{symbol} = {_scaled(value, factor, unit)}"


def _load_text(row: dict) -> str:
    predicted = f" ({' and '.join(row['predicted'])} not measured)".replace("_", " ") if row["predicted"] else ""
    turned, absorbed = _scaled(row["theta_L_rad"], ARCMIN, "′"), _scaled(row["W_L_J"], 1e3, " mJ")
    arrives = f"load {row['load_Nm']:.4g} N·m at {row['loading_rate_Nm_per_s']:.3g} N·m/s"
    return f"{arrives}: θ_L = {turned}, W_L = {absorbed}{predicted}"


def _scaled(value: dict, factor: float, unit: str) -> str:
    median, lo, hi = (value[part] * factor for part in ("median", "lo", "hi"))
    return f"{median:.4g} [{lo:.4g}, {hi:.4g}]{unit}"
