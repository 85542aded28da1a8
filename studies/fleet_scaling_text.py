"""The report of the study of fleets' speed, and what its figures mean for a thousand cores."""

from __future__ import annotations

import numpy as np

SETTLED = 50
"""Units after which a worker's memory is taken to be that of its libraries."""
CORES = 1000
WITH_DIAGNOSIS = 3
"""Times that a fit with its diagnosis takes a fit's time, roughly."""


def heartbeats_per_s(workers: int) -> float:
    """Of all workers, as distributed spaces them."""
    from distributed.scheduler import heartbeat_interval

    return workers / heartbeat_interval(workers)


def projection(cost: dict, task_s: float, cores: int) -> dict:
    """Share of the scheduler's one core that ``cores`` workers with tasks of ``task_s`` take, by tasks and by heartbeats."""
    beat_s = cost["rest_cpu"] / heartbeats_per_s(cost["workers"])
    tasks = cores / task_s
    return {
        "tasks_per_s": tasks, "by_tasks": tasks * cost["cpu_ms"] / 1e3, "by_heartbeats": heartbeats_per_s(cores) * beat_s,
        "megabytes_per_s": (tasks * cost["bytes"] + heartbeats_per_s(cores) * cost["rest_bytes"]
                            / heartbeats_per_s(cost["workers"])) / 1e6,
    }  # fmt: skip


def saturated_at(cost: dict, task_s: float) -> int:
    """Cores at which the scheduler has no time left."""
    counts = np.unique(np.geomspace(10, 1e6, 2000).astype(int))
    busy = [sum(projection(cost, task_s, int(n))[key] for key in ("by_tasks", "by_heartbeats")) for n in counts]
    return int(counts[np.searchsorted(busy, 1.0)])


def written(found, repeats, rounds, memory, costs, fitted) -> str:
    """The text: runs of small units by what ran them, a long run, schedulers' costs, and runs of real fits."""
    return "\n".join([
        "# How fast is a fleet, and where does it end?", "",
        f"Made by `python studies/fleet_scaling.py` on {found['machine']}. Other work ran beside it: load averages",
        f"{', '.join(f'{x:.1f}' for x in found['load'])} on these cores. That stretches wall times, not processor times.", "",
        *_overhead(repeats, rounds, fitted), *_real(fitted), *_memory(memory), *_scheduler(costs), *_paper(rounds, costs, fitted),
    ])  # fmt: skip


def _overhead(repeats, rounds, fitted):
    wall, cpu = (1e3 * np.median([r[i] for r in rounds["plain"]]) for i in (0, 1))
    one, two = rounds[1], rounds[2]
    speedup, slowed = _wall(one) / _wall(two), _work(two) / _work(one)
    gap, task = _gap_ms(two), _task_ms(two)
    over, fit_ms = _work(one) + _rest(one) - cpu, 1e3 * _fit_s(fitted)
    return [
        "## Overhead and scaling", "",
        f"{one[0].units} small units a run, {len(one)} rounds of all three in turn, medians, without the few seconds in which",
        f"workers start. The work is the classic least-squares evaluation, {repeats} times over.", "",
        "| | wall [ms a unit] | processor: work [ms a unit] | processor: scheduler and client [ms a unit] | units a minute |",
        "|---|---|---|---|---|",
        f"| a plain loop | {wall:.0f} | {cpu:.0f} | – | {6e4 / wall:.0f} |",
        *(f"| a fleet, {n} worker{'s'[: n > 1]} | {_wall(r):.0f} | {_work(r):.0f} | {_rest(r):.0f} | {6e4 / _wall(r):.0f} |"
          for n, r in ((1, one), (2, two))), "",
        f"- Two workers are {speedup:.2f} times as fast as one: efficiency {speedup / 2:.2f} by wall time, under a load that",
        "  leaves a second process a share of its own.",
        f"- Without other work two things would limit it: beside a second worker the work takes {slowed:.2f} times the processor",
        f"  time, and a worker waits {gap:.1f} ms (median) from one unit of {task:.0f} ms to the next. Efficiency from these: "
        f"{min(1.0, 1 / slowed) * task / (task + gap):.2f}.",
        f"- Overhead against the plain loop: {over:.0f} ms of processor time a unit, {100 * over / fit_ms:.2f} % of a fit.", "",
    ]  # fmt: skip


def _real(fitted):
    one, two = fitted[1], fitted[2]
    wall, cpu = ([getattr(r, key) / r.units for r in (one, two)] for key in ("wall_s", "work_cpu_s"))
    return [
        "## Real fits", "",
        "| workers | fits | wall [s a fit] | processor [s a fit] | fits a minute | memory in the first and last third [MB] |",
        "|---|---|---|---|---|---|",
        *(f"| {n} | {r.units} | {w:.1f} | {c:.1f} | {60 / w:.1f} | {_thirds(r)} |"
          for (n, r), w, c in zip(fitted.items(), wall, cpu, strict=True)), "",
        f"Efficiency of two workers: {wall[0] / wall[1] / 2:.2f} by wall time under that load; beside a second a fit takes",
        f"{cpu[1] / cpu[0]:.2f} times the processor time, which makes {min(1.0, cpu[0] / cpu[1]):.2f}.", "",
    ]  # fmt: skip


def _memory(run):
    settled = run.memory[run.memory[:, 0] >= SETTLED]
    slope = 100 * np.polyfit(*settled.T, 1)[0]
    return [
        "## Memory", "",
        f"{run.units} small units on two workers: {settled[:, 1].min():.0f} to {settled[:, 1].max():.0f} MB a worker after",
        f"the first {SETTLED}, {slope:+.2f} MB a hundred units of the fleet.", "",
    ]  # fmt: skip


def _scheduler(costs):
    return [
        "## Scheduler", "",
        "A scheduler in a process of its own; units whose results are there already, so that the engine's own work is left.", "",
        "| workers | units | units a second | scheduler [ms a unit] | client [ms a unit] | bytes a unit "
        "| scheduler at rest [% of a core] | bytes a second at rest |",
        "|---|---|---|---|---|---|---|---|",
        *(f"| {c['workers']} | {c['tasks']} | {c['tasks_per_s']:.0f} | {c['cpu_ms']:.2f} | {c['client_ms']:.2f} "
          f"| {c['bytes']:.0f} | {100 * c['rest_cpu']:.1f} | {c['rest_bytes']:.0f} |" for c in costs), "",
    ]  # fmt: skip


def _paper(rounds, costs, fitted):
    cost, small, fit = costs[-1], _task_ms(rounds[2]) / 1e3, _fit_s(fitted)
    kinds = (("small units of this study", small), ("fits", fit), ("fits with diagnosis, as three fits", WITH_DIAGNOSIS * fit))
    rows = [(f"{what} ({t:.2g} s)", projection(cost, t, CORES), saturated_at(cost, t)) for what, t in kinds]
    return [
        f"## {CORES} cores, on paper", "",
        "From the figures above for the larger number of workers, with heartbeats spaced as Dask spaces them and one core",
        "for the scheduler.", "",
        "| units | units a second | scheduler busy with units | with heartbeats | megabytes a second | scheduler saturated at |",
        "|---|---|---|---|---|---|",
        *(f"| {what} | {p['tasks_per_s']:.0f} | {100 * p['by_tasks']:.0f} % | {100 * p['by_heartbeats']:.0f} % "
          f"| {p['megabytes_per_s']:.2f} | {full} cores |" for what, p, full in rows), "",
        "Workers read the data and write the results, so that the file system carries them. Where the scheduler is",
        "saturated, workers wait and nothing is lost. Then: one fleet a part of the archive, each with an output folder and a",
        "scheduler of its own, whose Parquet tables are read as one dataset; or longer units (`--diagnose`).", "",
    ]  # fmt: skip


def _fit_s(fitted):
    return fitted[1].work_cpu_s / fitted[1].units


def _gap_ms(runs):
    return 1e3 * np.median(np.concatenate([r.gaps_s for r in runs]))


def _task_ms(runs):
    return 1e3 * np.median(np.concatenate([r.task_s for r in runs]))


def _wall(runs):
    return 1e3 * np.median([r.wall_s / r.units for r in runs])


def _work(runs):
    return 1e3 * np.median([r.work_cpu_s / r.units for r in runs])


def _rest(runs):
    return 1e3 * np.median([r.rest_cpu_s / r.units for r in runs])


def _thirds(run):
    done, memory = run.memory.T
    first, last = memory[done <= run.units / 3], memory[done >= 2 * run.units / 3]
    return f"{np.median(first):.0f}, {np.median(last):.0f}"
