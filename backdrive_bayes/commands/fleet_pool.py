"""`fleet --pool batch`: every batch's posteriors pooled, read on the workers, one folder ``pools/BATCH`` with pool.json each."""

from __future__ import annotations

import hashlib
import re
import shutil
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

from backdrive_bayes.commands.output import say, write_folder, write_json
from backdrive_bayes.commands.results import draw_figures
from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.store import DONE, posterior_folder
from backdrive_bayes.fleet.summary import batch_of
from backdrive_bayes.fleet.task import Job
from backdrive_bayes.fleet.units import FleetUnit

POOLS = "pools"


def read_draws(folder: Path, name: str, seed: int):
    """What pooling takes of a unit, from its kept result folder."""
    from backdrive_bayes.decisions.evidence import Evidence
    from backdrive_bayes.pooling.unit import unit_draws

    return unit_draws(Evidence.read(folder), name, seed)


def retire_pools(out: Path) -> None:
    """Take away the pools of an earlier run: its units may be others."""
    shutil.rmtree(out / POOLS, ignore_errors=True)


def pool_fleet(job: Job, units: list[FleetUnit], found: list, client, level: float, figures: bool, note: Callable) -> list[Path]:
    """Pool the batches of a fleet's ``units``, whose table rows ``found`` holds, and return the folders written.

    A batch with too few units that can be pooled is said and left out.
    """
    batches = defaultdict(list)
    for unit, (_, _, rows) in zip(units, found, strict=True):
        if rows[0]["status"] == DONE:
            batches[batch_of(rows[0])].append(unit)
    written: list[Path] = []
    for batch, members in sorted(batches.items()):
        note(f"pooling {len(members)} units of batch '{batch}'", len(written) / len(batches))
        try:
            pool = _pooled(job, batch, members, client, level)
        except BadInput as few:
            say(f"  not pooled: {few}")
            continue
        folder = job.out / POOLS / _file_name(batch)
        with write_folder(folder) as room:
            write_json(room / "pool.json", pool)
            if figures:
                draw_figures("pool.json", room)
        written.append(folder)
    return written


def _file_name(batch: str) -> str:
    """The batch's name, with a digest of all of it where no file may be called so."""
    readable = re.sub(r"[^\w.+-]+", "-", batch).strip(".-")[-60:] or "all"
    return readable if readable == batch else f"{readable}.{hashlib.sha256(batch.encode()).hexdigest()[:10]}"


def _pooled(job: Job, batch: str, members: list[FleetUnit], client, level: float) -> dict:
    from backdrive_bayes.decisions.outcome import outcome_of
    from backdrive_bayes.pooling.pool import pool_batch

    told, lost = {}, []

    def finished(name, draws, error):
        if error is None:
            told[name] = draws
        else:
            lost.append({"unit": name, "why": " ".join(str(error).split())[:300]})

    items = {u.name: (posterior_folder(job.out, u), u.name, job.seed) for u in members}
    cluster.run_all(client, read_draws, items, finished)
    # In the order of the units, whichever worker was first: the same seed gives the same bytes.
    pool = pool_batch(batch, [told[u.name] for u in members if u.name in told], job.seed, level)
    pool["left_out"] += sorted(lost, key=lambda row: row["unit"])
    pool |= {"version": job.version, "options": job.options}
    return pool | {"outcome": outcome_of(pool).to_json()}


def show_pools(folders: list[Path]) -> None:
    """A line a batch, and one a quantity that was refused."""
    from backdrive_bayes.decisions.outcome import line
    from backdrive_bayes.results import POOL, read_result

    for folder in folders:
        pool = read_result(folder / "pool.json", POOL)
        say(f"  batch '{pool['batch']}': {line(pool['outcome'])}; {folder}")
        for found in pool["quantities"]:
            if found["refused"]:
                say(f"    {found['name']} refused: {found['refused']}")
