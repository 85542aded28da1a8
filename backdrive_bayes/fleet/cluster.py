"""Dask's scheduler, a local one of our own or a running one: the only module that knows dask.distributed."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import itertools
import logging
import threading
import uuid
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec

from backdrive_bayes.blind.workers import silence_tracker
from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.fleet.store import CannotKeep

RETRIES = 2
"""Times that a unit is tried again after it took its worker down."""
WAIT_S = 30
"""For a scheduler to answer and to show its workers [s]."""
LOOP_WAIT_S = 120
"""For a thread of this process to run its event loop [s]: only a machine without any time to spare takes longer."""
REPLACE_S = 2
"""Between two looks whether a worker is missing [s]."""
SETTINGS = {
    "distributed.scheduler.work-stealing": False,
    "distributed.scheduler.allowed-failures": RETRIES,
    # A worker holds the unit that it works on and no other, so that only this one is blamed where the worker dies.
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.worker.daemon": True,
    # A unit's seconds of algebra are no hanging event loop; watching for one, and sampling what a worker does, take a tenth of a
    # core.
    "distributed.admin.tick.limit": "1h",
    "distributed.admin.tick.interval": "1s",
    "distributed.worker.profile.enabled": False,
}


@dataclass(frozen=True)
class Tls:
    """Files of a scheduler that speaks TLS."""

    ca: str
    cert: str
    key: str


@functools.cache
def event_loop():
    """The tornado loop of all clients and clusters of this process, running in a thread of its own.

    Clients and clusters that are given none start one each, wait ten seconds for its thread and then fail on an assertion,
    which happens on a busy machine (``distributed.utils.LoopRunner``, no option changes it).
    """
    from tornado.ioloop import IOLoop

    ready, found = threading.Event(), []

    async def run() -> None:
        found.append(IOLoop.current())
        ready.set()
        await asyncio.Event().wait()

    threading.Thread(target=lambda: asyncio.run(run()), daemon=True, name="loop of dask").start()
    if not ready.wait(LOOP_WAIT_S):
        raise BadInput("fleet", f"a thread that starts within {LOOP_WAIT_S} s", "none: the machine has no time to spare")
    return found[0]


@contextlib.contextmanager
def local(workers: int) -> Iterator:
    """A client of a cluster on this machine, processes of one thread each that are replaced whenever they die."""
    distributed = _distributed()
    import dask
    from tornado.ioloop import PeriodicCallback

    silence_tracker()
    logging.getLogger("tornado.application").setLevel(logging.CRITICAL)
    with dask.config.set(SETTINGS), contextlib.ExitStack() as stack:
        loop = event_loop()
        cluster = distributed.LocalCluster(
            n_workers=0, threads_per_worker=1, processes=True, host="127.0.0.1", loop=loop,
            dashboard_address="127.0.0.1:0", silence_logs=logging.CRITICAL,
        )  # fmt: skip
        stack.enter_context(cluster)
        cluster.scale(workers)  # unlike a number given above it bears with workers that die while they start
        watch = cluster.periodic_callbacks["replace"] = PeriodicCallback(lambda: _replace(cluster), 1000 * REPLACE_S)
        loop.add_callback(watch.start)
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        with contextlib.suppress(TimeoutError):
            client.wait_for_workers(workers, timeout=WAIT_S)
        if not threads(client):
            raise BadInput("--workers", f"a worker process that starts within {WAIT_S} s", "none")
        yield client


def _replace(cluster) -> None:
    """Start workers anew whose keeper gave them up, as it does where one dies while it starts, and those that dask forgot."""
    gone = [name for name, keeper in cluster.workers.items() if keeper.status.name in ("closed", "failed")]
    for name in gone:
        del cluster.workers[name]
    if len(cluster.workers) < len(cluster.worker_spec):
        cluster.scale(len(cluster.worker_spec))


@contextlib.contextmanager
def joined(address: str, tls: Tls | None = None) -> Iterator:
    """A client of a running scheduler; BadInput where none answers or it has no worker. Its own settings hold."""
    distributed = _distributed()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    security = None
    if tls:
        security = distributed.Security(
            require_encryption=True, tls_ca_file=tls.ca, tls_client_cert=tls.cert, tls_client_key=tls.key
        )
    options = {"security": security, "timeout": WAIT_S, "set_as_default": False, "loop": event_loop()}
    try:
        client = _connected(distributed.Client, address, options)
    except (OSError, ValueError, TypeError) as error:
        expected = "the address of a running scheduler, such as tcp://host:8786"
        raise BadInput("--scheduler", expected, f"{address} ({error or type(error).__name__})") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=WAIT_S)
        except TimeoutError:
            raise BadInput("--scheduler", "a scheduler with workers", f"none at {address} after {WAIT_S} s") from None
        yield client


def _connected(kind, address: str, options: dict):
    """A client; one that does not connect is closed here, for dask's garbage collection may ask the loop to wait for itself."""
    client = kind.__new__(kind)
    try:
        client.__init__(address, **options)
    except BaseException:
        with contextlib.suppress(Exception):
            client.close()
        raise
    return client


def dashboard(client) -> str | None:
    """Address of the scheduler's page, which needs bokeh; None without."""
    return client.dashboard_link if find_spec("bokeh") else None


def threads(client) -> int:
    """Units that the cluster works on at a time."""
    return sum(client.nthreads().values())


def run_all(client, function: Callable, items: dict, finished: Callable[[str, object, Exception | None], None]) -> None:
    """Call ``function(*items[name])`` for every name on the cluster and hand name, value and error to ``finished``.

    The error is KilledWorker's text for a call that took its workers down, retries included. Raises CannotKeep as soon as a
    call does, and ConnectionError where the scheduler goes away.
    """
    distributed = _distributed()
    given, waiting, group = {}, iter(items), f"unit-{uuid.uuid4().hex}"  # other clients' keys are not ours
    # A group of few calls is not queued by the scheduler but dealt out at once: then the next is given when one is done.
    first = len(items) if len(items) > 2 * threads(client) else threads(client)

    def submitted(count):
        for name in itertools.islice(waiting, count):
            future = client.submit(function, *items[name], key=(group, name), pure=False)
            given[future.key] = name, future
            yield future

    running = distributed.as_completed(list(submitted(first)), loop=client.loop)
    try:
        for future in running:
            name, _ = given.pop(future.key)
            value, error = _outcome(future)
            future.release()
            if isinstance(error, CannotKeep):
                raise error
            finished(name, value, error)
            running.update(list(submitted(1)))
    except ConnectionError:
        raise
    except BaseException:
        client.cancel([future for _, future in given.values()])
        raise


def deaths(error: Exception) -> int:
    """Workers that a call took down before it was given up; 0 where it ended otherwise."""
    return error.allowed_failures + 1 if isinstance(error, _distributed().KilledWorker) else 0


def _outcome(future):
    try:
        if future.status == "cancelled":  # one that was lost with its worker is worked on again, and waited for below
            raise ConnectionError("the scheduler went away")
        error = future.exception()
        return (None, error) if error else (future.result(), None)
    except Exception as raised:
        if type(raised).__name__ in ("CancelledError", "FutureCancelledError", "CommClosedError", "FuturesCancelledError"):
            raise ConnectionError("the scheduler went away") from None
        raise


def _distributed():
    try:
        import distributed
    except ImportError:
        raise MissingExtra("fleets", "distributed", "fleet") from None
    return distributed
