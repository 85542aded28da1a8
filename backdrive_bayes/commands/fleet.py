"""`fleet`: every unit below a folder, on all cores or a cluster, resumable."""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path

from backdrive_bayes.commands.output import default_out, say, write_json
from backdrive_bayes.commands.progress import progress
from backdrive_bayes.commands.results import FitOptions, add_fit_arguments, draw_figures, keep_run, retire_figures
from backdrive_bayes.decisions.outcome import line, outcome_of
from backdrive_bayes.errors import BadInput

HELP = "fit (and diagnose and judge) every unit below a folder, on all cores or a cluster; run again, it goes on where it stood"
NAME = "fleet.json"


def add_arguments(parser) -> None:
    """Options of this verb."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder with unit folders or record files below it")
    parser.add_argument("--workers", type=int, metavar="N", help="processes on this machine (default: one a core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="join a running dask scheduler, such as tcp://host:8786")
    for name, what in (("ca", "authority's certificate"), ("cert", "client's certificate"), ("key", "client's key")):
        parser.add_argument(f"--tls-{name}", type=Path, metavar="FILE", help=f"{what} for a scheduler at tls://…")
    parser.add_argument("--diagnose", action="store_true", help="also diagnose every unit")
    parser.add_argument("--limits", type=Path, metavar="LIMITS.toml", help="also diagnose every unit and judge it against limits")
    parser.add_argument("--posteriors", action="store_true", help="keep every unit's result folder (about 3 MB a unit)")
    parser.add_argument("--pool", choices=("batch",), help="also pool the units of every batch (keeps the posteriors)")
    parser.add_argument("--order", choices=("test_date", "serial", "unit"), help="order of the control charts (default: the first"
                        " of test_date, serial and path that every unit has)")  # fmt: skip
    add_fit_arguments(parser)


def run(args) -> int:
    """Write a result file a unit, two tables, fleet.json and figures; 0 done, 4 where a unit has no result."""
    from backdrive_bayes.commands.fleet_pool import show_pools
    from backdrive_bayes.fleet import cluster, store, summary, table
    from backdrive_bayes.fleet.run import run_fleet
    from backdrive_bayes.fleet.units import find_units

    began = time.perf_counter()
    table.require_pyarrow()
    out = args.out or default_out(args.folder.resolve().name, "fleet")
    job, units = _job(args, out), find_units(args.folder, out)
    with ExitStack() as stack:
        stack.enter_context(store.locked(out))
        client = stack.enter_context(_client(args, cluster))
        page = cluster.dashboard(client) or "none (needs the package bokeh)"
        say(f"{len(units)} units, {cluster.threads(client)} workers; dashboard: {page}")
        with progress() as note:
            note(f"0 of {len(units)} units", 0.0)
            tally = run_fleet(job, units, client, note)
        table.compact(out, units)
        found = summary.collect(out, units)
        if len(found) < len(units):
            raise BadInput(out, "a folder that all workers write to", f"no results of {len(units) - len(found)} units in it")
        result = summary.summarise(found, args.order)
        result |= {"version": job.version, "seed": args.seed, "options": job.options}
        result["outcome"] = outcome_of(result).to_json()
        write_json(out / NAME, result)
        keep_run(out, "fleet", began)
        retire_figures(out, ("",))
        if not args.no_figures:
            draw_figures("fleet.json", out)
        pools = _pools(args, job, units, found, client)
    _summarise(result, tally, out)
    show_pools(pools)
    return result["outcome"]["exit_code"]


def _job(args, out: Path):
    from backdrive_bayes.commands.fleet_unit import UnitWork
    from backdrive_bayes.decisions.limits import read_limits
    from backdrive_bayes.fleet.task import Job

    options, limits = FitOptions.of(args), read_limits(args.limits) if args.limits else None
    options = replace(options, k=(limits.only_k(args.limits) if limits else None) or options.k)
    told = options.to_json() | {"diagnose": args.diagnose or limits is not None, "force": args.force}
    told["limits"] = [_plain(limit) for limit in limits.limits] if limits else None
    told["risks"] = [limits.consumer, limits.producer] if limits else None
    work = UnitWork(options, args.diagnose, limits, args.force)
    return Job(out.resolve(), work, args.seed, told, args.posteriors or bool(args.pool))


def _pools(args, job, units, found, client) -> list[Path]:
    from backdrive_bayes.commands.fleet_pool import pool_fleet, retire_pools

    retire_pools(job.out)
    if not args.pool:
        return []

    with progress() as note:
        return pool_fleet(job, units, found, client, args.level, not args.no_figures, note)


def _plain(limit) -> dict:
    """A limit as JSON has it, without the file that it stood in; no bound is null."""
    plain = {key: value for key, value in asdict(limit).items() if key != "where"}
    return {key: None if value in (float("inf"), float("-inf")) else value for key, value in plain.items()}


def _client(args, cluster):
    tls = [args.tls_ca, args.tls_cert, args.tls_key]
    if any(tls) and not (args.scheduler and all(tls)):
        raise BadInput("--tls-ca, --tls-cert, --tls-key", "all three, with --scheduler tls://…", "some of them")
    if args.scheduler:
        if args.workers is not None:
            raise BadInput("--workers", "no number of workers for a running scheduler", args.workers)
        return cluster.joined(args.scheduler, cluster.Tls(*map(str, tls)) if all(tls) else None)
    if args.workers is not None and not 1 <= args.workers <= 1024:
        raise BadInput("--workers", "a number from 1 to 1024", args.workers)
    return cluster.local(args.workers or os.cpu_count() or 1)


def _summarise(result: dict, tally, out: Path) -> None:
    counts = result["counts"]
    say(line(result["outcome"]))
    kept = f" ({tally.counts['kept']} were there already)" if tally.counts["kept"] else ""
    say(f"{counts['units']} units: {counts['done']} done{kept}, {counts['converged']} converged, {counts['failed']} failed, "
        f"{counts['set_aside']} set aside; {tally.per_minute:.3g} a minute")  # fmt: skip
    for failure in result["failures"][:10]:
        say(f"  {failure['unit']}: {failure['error']}")
    if len(result["failures"]) > 10:
        say(f"  and {len(result['failures']) - 10} more in {NAME}")
    for name, where in result["same_names"].items():
        say(f"  warning: {len(where)} units are named '{name}' ({', '.join(where[:5])}); rows are distinguished by their folder")
    for what in ("verdicts", "effects"):
        if result[what]:
            say(f"  {what}: " + ", ".join(f"{n} {name}" for name, n in result[what].items()))
    for chart in result["charts"]:
        if chart["drift"] and chart["drift"]["alarm"]:
            say(f"  drift of {chart['indicator']} from about {chart['drift']['first']} on "
                f"(by chance {chart['drift']['probability']:.2g})")  # fmt: skip
    say(f"written to {out}/fleet.parquet, records.parquet and {NAME}")
