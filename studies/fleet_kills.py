"""Is anything lost? 500 units while workers are killed at random moments and the whole run is killed twice, against a quiet run.

    python studies/fleet_kills.py [--units 500] [--out reports/fleet-kills]

The work on a unit is the classic least-squares evaluation, a few hundredths of a second: this shows the engine of fleets, not the
inference. Every kill is SIGKILL. A run ends where it is killed; the next one is the same command. Then the files are compared.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from fleet_common import Classic, make_units

from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.run import run_fleet
from backdrive_bayes.fleet.store import locked
from backdrive_bayes.fleet.table import NAME, compact
from backdrive_bayes.fleet.task import Job
from backdrive_bayes.fleet.units import find_units

WORKERS = 2
BETWEEN_S = 3.0
"""Mean of the exponential time between two kills of a worker."""
RUNS_KILLED = (0.3, 0.65)
"""Shares of the units that are done when the whole run is killed, on the average."""


def run(folder: Path, out: Path) -> None:
    """One run; its last line is its tally."""
    units = find_units(folder, out)
    with locked(out), cluster.local(WORKERS) as client:
        tally = run_fleet(Job(out, Classic()), units, client)
        compact(out, units)
    print(json.dumps(dict(tally.counts)), flush=True)


def start(folder: Path, out: Path) -> subprocess.Popen:
    command = [sys.executable, __file__, "--run", str(folder), str(out)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def workers_of(running) -> list[psutil.Process]:
    try:
        found = psutil.Process(running.pid).children(recursive=True)
        return [p for p in found if "spawn_main" in " ".join(p.cmdline())]
    except psutil.Error:
        return []


def finished(out: Path) -> int:
    return len(list((out / "units").glob("*.json")))


def disturbed(folder: Path, out: Path, units: int, rng) -> dict:
    """Runs until one ends by itself; what was done to them."""
    told: dict = {"workers_killed": 0, "runs_killed_at": [], "orphans": 0}
    goals = [int(units * min(0.95, max(0.05, share + 0.1 * rng.standard_normal()))) for share in RUNS_KILLED]
    while True:
        running = start(folder, out)
        goal, next_kill, before = goals.pop(0) if goals else None, time.monotonic(), finished(out)
        while running.poll() is None:
            time.sleep(0.02)
            if finished(out) == before:  # it has not begun
                continue
            workers = workers_of(running) if time.monotonic() > next_kill else []
            if workers:
                rng.choice(np.array(workers, object)).kill()
                told["workers_killed"] += 1
                next_kill = time.monotonic() + rng.exponential(BETWEEN_S)
            if goal is not None and finished(out) >= goal:
                workers = workers_of(running)
                running.send_signal(signal.SIGKILL)
                running.wait()
                told["runs_killed_at"].append(finished(out))
                told["orphans"] += len(psutil.wait_procs(workers, timeout=20)[1])
                break
        text, complaints = running.communicate()
        if running.returncode not in (0, -signal.SIGKILL):
            raise RuntimeError(complaints[-2000:])
        if goal is None:
            return told | {"last_run": json.loads(text.splitlines()[-1])}


def digests(out: Path) -> dict[str, str]:
    """SHA-256 of the table and of every file that a unit has."""
    files = [out / NAME, *sorted(p for p in (out / "units").iterdir())]
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def written(units: int, quiet: dict, after: dict, told: dict, seconds: float) -> str:
    same = sum(quiet[name] == after.get(name) for name in quiet)
    extra = len(set(after) - set(quiet))
    at = " and ".join(f"{n} of {units}" for n in told["runs_killed_at"])
    last = ", ".join(f"{n} {status}" for status, n in sorted(told["last_run"].items()))
    return f"""# Is anything lost when workers and runs are killed?

Made by `python studies/fleet_kills.py --units {units}`. The work on a unit is the classic least-squares evaluation: this shows
the engine of fleets and not the inference.

| what | figure |
|---|---|
| units of virtual reducers, one loop each | {units} |
| workers at a time | {WORKERS} |
| workers killed (SIGKILL, at random moments, {BETWEEN_S:g} s apart on the average) | {told["workers_killed"]} |
| whole runs killed (SIGKILL), with so many units done | {len(told["runs_killed_at"])}: {at} |
| workers that outlived their run by 20 s | {told["orphans"]} |
| the last run, which ended by itself | {last} |
| result files and table identical to those of an undisturbed run | {same} of {len(quiet)} |
| files that the undisturbed run does not have | {extra} |

The disturbed runs took {seconds:.0f} s in all, with the starts of {len(told["runs_killed_at"]) + 1} clusters.
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("reports/fleet-kills"))
    parser.add_argument("--run", nargs=2, type=Path, metavar=("FOLDER", "OUT"), help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.run:
        run(*args.run)
        return
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        folder = make_units(room / "fleet", args.units)
        done = start(folder, room / "quiet")
        _, complaints = done.communicate()
        if done.returncode:
            raise RuntimeError(complaints[-2000:])
        began = time.monotonic()
        told = disturbed(folder, room / "out", args.units, np.random.default_rng(args.seed))
        seconds = time.monotonic() - began
        quiet, after = digests(room / "quiet"), digests(room / "out")
    args.out.mkdir(parents=True, exist_ok=True)
    text = written(args.units, quiet, after, told, seconds)
    (args.out / "README.md").write_text(text, encoding="utf-8")
    print(text)
    if quiet != after:
        raise SystemExit("the disturbed run differs from the undisturbed one")


if __name__ == "__main__":
    main()
