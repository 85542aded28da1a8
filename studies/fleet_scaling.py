"""How fast is a fleet, and where does it end? Overhead, scaling, memory, scheduler and bytes measured; 1 000 cores on paper.

    python studies/fleet_scaling.py [--units 500] [--real 12] [--out reports/fleet]
    unshare -n python studies/fleet_scaling.py …    bytes of this study alone (needs root), else those of the whole loopback

Small units carry the classic least-squares evaluation, repeated to about a third of a second; a dozen are fitted for real. Other
work on the machine stretches wall times: processor seconds, which it does not, stand beside them, and runs alternate.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from fleet_common import STUDIES, Classic, make_units
from fleet_scaling_text import written

from backdrive_bayes.commands.fleet_unit import UnitWork
from backdrive_bayes.commands.results import FitOptions
from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.run import run_fleet
from backdrive_bayes.fleet.store import locked
from backdrive_bayes.fleet.task import Job, carry_out
from backdrive_bayes.fleet.units import find_units

REPEATS = 10
ROUNDS = 3


@dataclass(frozen=True)
class Run:
    """One run: wall and processor seconds, of the work and of the rest, of so many units, and gaps between them on a worker."""

    units: int
    wall_s: float
    work_cpu_s: float
    rest_cpu_s: float
    gaps_s: np.ndarray
    task_s: np.ndarray
    memory: np.ndarray
    """Rows of units done and a worker's memory [MB]."""


def cpu_s(pid: int | None = None) -> float:
    times = psutil.Process(pid).cpu_times()
    return times.user + times.system


def plain(units, out: Path, work) -> tuple[float, float]:
    """Wall and processor seconds a unit of a loop in this process, without a cluster."""
    job = Job(out, work)
    with locked(out):
        began, cpu = time.perf_counter(), cpu_s()
        for unit in units:
            carry_out(job, unit)
    return (time.perf_counter() - began) / len(units), (cpu_s() - cpu) / len(units)


def fleet(units, out: Path, work, workers: int) -> Run:
    """A run on a cluster of this machine whose workers have done one unit each before."""
    from distributed import get_task_stream

    with locked(out), cluster.local(workers) as client:
        warm, rest = units[:workers], units[workers:]
        run_fleet(Job(out, work), warm, client)
        pids = list(client.run(os.getpid).values())
        memory, done, stop = [], [0], threading.Event()

        def watch():
            while not stop.wait(0.25):
                memory.extend((done[0], psutil.Process(pid).memory_info().rss / 1e6) for pid in pids)

        watching = threading.Thread(target=watch)
        watching.start()
        with get_task_stream(client) as stream:
            began, cpu, own = time.perf_counter(), sum(map(cpu_s, pids)), cpu_s()
            run_fleet(Job(out, work), rest, client, lambda text, share: done.__setitem__(0, round(share * len(rest))))
            wall, cpu, own = time.perf_counter() - began, sum(map(cpu_s, pids)) - cpu, cpu_s() - own
        stop.set()
        watching.join()
    gaps, tasks = gaps_of(stream.data)
    return Run(len(rest), wall, cpu, own, gaps, tasks, np.array(memory).reshape(-1, 2))


def gaps_of(tasks) -> tuple[np.ndarray, np.ndarray]:
    """Seconds from the end of a unit to the beginning of the next on the same worker, and seconds of the units."""
    by_worker: dict[str, list] = {}
    for task in tasks:
        own = next(s for s in task["startstops"] if s["action"] == "compute")
        by_worker.setdefault(task["worker"], []).append((own["start"], own["stop"]))
    gaps, lasted = [], []
    for spans in by_worker.values():
        spans.sort()
        gaps += [b[0] - a[1] for a, b in zip(spans[:-1], spans[1:], strict=True)]
        lasted += [b - a for a, b in spans]
    return np.array(gaps), np.array(lasted)


def loopback_bytes() -> int:
    return psutil.net_io_counters(pernic=True)["lo"].bytes_sent


def scheduler_cost(units, out: Path, workers: int, times: int) -> dict:
    """A scheduler in a process of its own: processor seconds and bytes a task, and at rest a second."""
    python = [sys.executable, "-m"]
    quiet: dict = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    environment = os.environ | {"PYTHONPATH": str(STUDIES), "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "1.0",
                                "DASK_DISTRIBUTED__SCHEDULER__WORK_STEALING": "False"}  # fmt: skip
    port = 18786 + os.getpid() % 1000
    address, host = f"tcp://127.0.0.1:{port}", ["--host", "127.0.0.1"]
    command = [*python, "distributed.cli.dask_scheduler", *host, "--port", str(port), "--dashboard-address", "127.0.0.1:0"]
    scheduler = subprocess.Popen(command, env=environment, **quiet)
    command = [*python, "distributed.cli.dask_worker", address, *host, "--nworkers", str(workers), "--nthreads", "1"]
    command += ["--no-dashboard"]
    keeper = subprocess.Popen(command, env=environment, **quiet)
    try:
        with locked(out), cluster.joined(address) as client:
            client.wait_for_workers(workers, timeout=120)
            job = Job(out, Classic())
            run_fleet(job, units, client)
            cpu, sent, began = cpu_s(scheduler.pid), loopback_bytes(), time.perf_counter()
            time.sleep(10)
            rest = [(cpu_s(scheduler.pid) - cpu), (loopback_bytes() - sent)]
            rest = [value / (time.perf_counter() - began) for value in rest]
            cpu, own, sent, began = cpu_s(scheduler.pid), cpu_s(), loopback_bytes(), time.perf_counter()
            for _ in range(times):
                run_fleet(job, units, client)  # every result is there: what is left is the engine's own work
            wall, tasks = time.perf_counter() - began, times * len(units)
            cpu, own, sent = cpu_s(scheduler.pid) - cpu, cpu_s() - own, loopback_bytes() - sent
        return {
            "workers": workers, "tasks": tasks, "tasks_per_s": tasks / wall,
            "cpu_ms": 1e3 * (cpu - rest[0] * wall) / tasks, "client_ms": 1e3 * own / tasks,
            "bytes": (sent - rest[1] * wall) / tasks, "rest_cpu": rest[0], "rest_bytes": rest[1],
        }  # fmt: skip
    finally:
        for process in (keeper, scheduler):
            process.terminate()
            process.wait(30)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=500)
    parser.add_argument("--timed", type=int, default=60)
    parser.add_argument("--real", type=int, default=12)
    parser.add_argument("--out", type=Path, default=Path("reports/fleet"))
    args = parser.parse_args()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    found: dict = {"load": [os.getloadavg()[0]], "machine": f"{os.cpu_count()} cores, {platform.machine()}"}
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        units = find_units(make_units(room / "fleet", args.units), room / "out")
        rounds = {"plain": [], 1: [], 2: []}
        for i in range(ROUNDS):
            rounds["plain"].append(plain(units[: args.timed], room / f"plain-{i}", Classic(REPEATS)))
            for workers in (1, 2):
                rounds[workers].append(fleet(units[: args.timed], room / f"{workers}-{i}", Classic(REPEATS), workers))
            found["load"].append(os.getloadavg()[0])
        memory = fleet(units, room / "memory", Classic(1), 2)
        costs = [scheduler_cost(units, room / f"cost-{n}", n, 4) for n in (2, 8)]
        real = units[: args.real]
        fitted = {n: fleet(real, room / f"real-{n}", UnitWork(FitOptions()), n) for n in (1, 2)}
        found["load"].append(os.getloadavg()[0])
    args.out.mkdir(parents=True, exist_ok=True)
    text = written(found, REPEATS, rounds, memory, costs, fitted)
    (args.out / "README.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
