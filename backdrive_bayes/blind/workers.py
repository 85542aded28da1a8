"""Run one function on many arguments in fresh processes that know nothing but these arguments."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from typing import Any


@dataclass(frozen=True)
class Outcome:
    """What became of one call: its ``value``, or the ``error`` that it raised in words."""

    value: Any
    error: str | None


def run_all(function: Callable, calls: Mapping[str, tuple], workers: int, done: Callable[[str, Outcome], None]) -> None:
    """Call ``function(*arguments)`` for every entry of ``calls`` and hand each outcome to ``done(name, outcome)``.

    Processes are spawned, not forked: they do not hold this process's memory. One that dies takes down those beside it, so
    what was under way is then run once more, each in a process of its own; a call that dies there has failed.
    """
    left = dict(calls)

    def finished(name, outcome):
        del left[name]
        done(name, outcome)

    if not _run_pool(function, dict(left), workers, finished):
        for name, arguments in dict(left).items():
            if not _run_pool(function, {name: arguments}, 1, finished):
                finished(name, Outcome(None, "the process died"))


def silence_tracker() -> None:
    """Start Python's resource tracker so that it says nothing of semaphores that it clears after an interrupted run."""
    option = "ignore:resource_tracker"
    sys.warnoptions.append(option)
    try:
        resource_tracker.ensure_running()
    finally:
        sys.warnoptions.remove(option)


def _run_pool(function, calls, workers, finished) -> bool:
    """Run in one pool; False when a process died, and with it what had not finished."""
    workers = min(workers, len(calls))
    if not workers:
        return True
    threads = max(1, (os.cpu_count() or 1) // workers)
    silence_tracker()
    pool = ProcessPoolExecutor(workers, get_context("spawn"), _begin, (threads,))
    alive = True
    try:
        futures: dict[Future, str] = {pool.submit(_guarded, function, args): name for name, args in calls.items()}
        for future in as_completed(futures):
            try:
                outcome = future.result()
            except BrokenProcessPool:
                alive = False
            else:
                finished(futures[future], outcome)
    except BrokenProcessPool:
        alive = False
    finally:
        pool.shutdown(cancel_futures=True)
    return alive


def _begin(threads: int) -> None:
    """Forget the command line, which holds the seed that units are drawn from, and share the cores out."""
    from threadpoolctl import threadpool_limits

    del sys.argv[1:]
    # Whoever started this process is interrupted too, and ends it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(threads)


def _guarded(function, arguments) -> Outcome:
    try:
        value, error = function(*arguments), None
    except Exception as raised:
        value, error = None, " ".join(f"{type(raised).__name__}: {raised}".split())
    return Outcome(value, error)
