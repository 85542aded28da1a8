"""Runs: every unit once and the same whatever happens to workers, the scheduler, the disk or the run."""

import asyncio
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import pytest
from support.fleet_units import Dies, Read, make_fleet, make_unit

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.run import run_fleet
from backdrive_bayes.fleet.store import locked, read_stored, result_path
from backdrive_bayes.fleet.table import NAME, compact
from backdrive_bayes.fleet.task import Job, carry_out
from backdrive_bayes.fleet.units import find_units

UNITS = 6
CLUSTER = """
import sys
from backdrive_bayes.fleet import cluster
if __name__ == "__main__":
    with cluster.local(1) as client:
        print(client.scheduler.address, flush=True)
        sys.stdin.read()
"""
TLS_CLUSTER = """
import sys
import distributed
from backdrive_bayes.fleet import cluster
if __name__ == "__main__":
    ca, key = sys.argv[1:]
    files = {f"tls_{w}_{what}": p for w in ("scheduler", "worker", "client") for what, p in (("cert", ca), ("key", key))}
    security = distributed.Security(require_encryption=True, tls_ca_file=ca, **files)
    options = {"security": security, "dashboard_address": "127.0.0.1:0", "loop": cluster.event_loop()}
    with distributed.LocalCluster(1, threads_per_worker=1, **options) as local:
        print(local.scheduler_address, flush=True)
        sys.stdin.read()
"""
RUN = """
import sys
from pathlib import Path
from support.fleet_units import Read
from backdrive_bayes.fleet import cluster, run, store, task, units
if __name__ == "__main__":
    folder, out = map(Path, sys.argv[1:])
    with store.locked(out), cluster.local(2) as client:
        found = units.find_units(folder, out)
        run.run_fleet(task.Job(out, Read(seconds=1.0)), found, client, lambda text, share: print(text, flush=True))
"""


@pytest.fixture(scope="module")
def local_cluster():
    """A client of two worker processes on this machine."""
    pytest.importorskip("distributed", reason="the extra fleet is not installed")
    with cluster.local(2) as client:
        yield client


@pytest.fixture
def two_workers(local_cluster):
    """The same client, with both workers there whatever an earlier test did to them, by their keepers and by the scheduler."""
    assert until(lambda: set(at_work(local_cluster)) <= set(local_cluster.nthreads()) and len(at_work(local_cluster)) == 2)
    return local_cluster


def at_work(client):
    """Addresses of the workers whose keepers run."""
    return [k.worker_address for k in list(client.cluster.workers.values()) if k.status.name == "running"]


@pytest.fixture
def fleet(tmp_path):
    return make_fleet(tmp_path / "fleet", UNITS)


@pytest.fixture(scope="module")
def undisturbed(local_cluster, tmp_path_factory):
    """The files of a run in which nothing happens."""
    room = tmp_path_factory.mktemp("undisturbed")
    return files(run(local_cluster, make_fleet(room / "fleet", UNITS), room / "out")[0])


def run(client, folder, out, work=None, units=None, note=lambda text, share: None, **job):
    units = units or find_units(folder, out)
    with locked(out):
        tally = run_fleet(Job(out, work or Read(), **job), units, client, note)
        compact(out, sorted(units, key=lambda unit: unit.name))
    return out, tally


def files(out):
    """The bytes of the table and of every result file."""
    return {p.name: p.read_bytes() for p in [out / NAME, *(out / "units").iterdir()]}


def assert_each_once(tally):
    """No unit failed; one that was done when its worker died may have been asked for again, and was there."""
    assert set(tally.counts) <= {"done", "kept"} and tally.finished == UNITS


def counts(tally):
    return dict(tally.counts)


def until(true, seconds=60):
    """Whether it becomes true in time."""
    deadline = time.monotonic() + seconds
    while not true() and time.monotonic() < deadline:
        time.sleep(0.05)
    return true()


def test_one_worker_or_two_in_any_order_give_the_same_bytes(fleet, tmp_path, undisturbed):
    units = find_units(fleet, tmp_path / "one")
    with cluster.local(1) as client:
        assert cluster.threads(client) == 1
        out, tally = run(client, fleet, tmp_path / "one", units=units[::-1])
    assert files(out) == undisturbed and len(undisturbed) == UNITS + 1 and counts(tally) == {"done": UNITS}


def test_a_second_run_does_what_changed_and_no_more(two_workers, fleet, tmp_path):
    out, _ = run(two_workers, fleet, tmp_path / "out")
    first = files(out)
    assert counts(run(two_workers, fleet, out)[1]) == {"kept": UNITS} and files(out) == first
    text = (fleet / "u-2" / "unit.toml").read_text()
    (fleet / "u-2" / "unit.toml").write_text(text.replace("S2", "S20"))
    damaged = result_path(out, find_units(fleet, out)[0])
    damaged.write_bytes(damaged.read_bytes()[:50])
    assert counts(run(two_workers, fleet, out)[1]) == {"kept": UNITS - 2, "done": 2}
    assert len({name for name, content in files(out).items() if content != first[name]}) == 2  # u-2 and the table
    for change in ({"seed": 1}, {"options": {"k": 0.05}}, {"posteriors": True}):
        assert counts(run(two_workers, fleet, out, **change)[1]) == {"done": UNITS}
        assert counts(run(two_workers, fleet, out, **change)[1]) == {"kept": UNITS}


def test_a_bad_unit_is_a_row_with_its_error_and_units_of_one_name_are_two(two_workers, fleet, tmp_path):
    (fleet / "u-1" / "a.csv").write_bytes(b"\x00\xff" * 1000)
    (fleet / "u-2" / "unit.toml").write_text("no = toml = here")
    (fleet / "u-3" / "a.csv").unlink()
    (fleet / "empty.csv").write_text("")
    make_unit(fleet / "again" / "u-4", seed=9)
    out, tally = run(two_workers, fleet, tmp_path / "out")
    assert counts(tally) == {"done": UNITS - 3 + 1, "failed": 4}
    found = {unit.name: read_stored(out, unit) for unit in find_units(fleet, out)}
    bad = {name: result["error"] for name, result in found.items() if result["status"] == "failed"}
    assert set(bad) == {"u-1", "u-2", "u-3", "empty.csv"} and "a.csv" in bad["u-1"] and "unit.toml" in bad["u-2"]
    assert found["u-4"]["rows"][0]["name"] == found["again/u-4"]["rows"][0]["name"]
    assert found["u-4"]["rows"][0]["lost_motion_rad"] != found["again/u-4"]["rows"][0]["lost_motion_rad"]
    assert counts(run(two_workers, fleet, out)[1]) == {"kept": UNITS + 2}, "what failed fails again, unless it changes"


@pytest.mark.parametrize(
    ("error", "again"), [(MissingExtra("reading", "p", "e"), True), (BadInput("a", "b", "c"), False)], ids=["reader", "file"]
)
def test_what_is_no_fault_of_the_unit_is_tried_again(fleet, tmp_path, error, again):
    """A reader that is not installed may be installed before the same command goes on; a file that cannot be read may not."""

    def work(path, folder):
        raise error

    unit, job = find_units(fleet, tmp_path)[0], Job(tmp_path, work)
    with locked(tmp_path):
        assert carry_out(job, unit).status == "failed"
        assert job.has(unit, job.stamp(unit)) != again


def test_a_posterior_of_before_does_not_stay_beside_another_result(fleet, tmp_path):
    """Made with posteriors, anew without, and with them again: what is there then rests on the present files."""
    unit, made = find_units(fleet, tmp_path)[0], []

    def work(path, folder):
        if folder is not None:
            folder.mkdir(parents=True)
        made.append(folder)
        return [{"unit": "u"}]

    with locked(tmp_path):
        for seed, posteriors in ((0, True), (1, False), (1, True)):
            carry_out(Job(tmp_path, work, seed=seed, posteriors=posteriors), unit)
    assert [folder is not None for folder in made] == [True, False, True]


def test_a_unit_whose_worker_dies_once_is_worked_on_again(two_workers, fleet, tmp_path, undisturbed):
    out, tally = run(two_workers, fleet, tmp_path / "out", Dies(tmp_path, ("u-3",), times=1))
    assert (tmp_path / "u-3.deaths").stat().st_size == 1
    assert_each_once(tally)
    assert files(out) == undisturbed


def test_a_unit_that_always_kills_its_worker_is_set_aside_and_no_other(two_workers, fleet, tmp_path, undisturbed):
    out, tally = run(two_workers, fleet, tmp_path / "out", Dies(tmp_path, ("u-3",)))
    assert (tmp_path / "u-3.deaths").stat().st_size == 1 + cluster.RETRIES == 3
    assert tally.counts["set_aside"] == 1 and tally.finished == UNITS
    unit = next(u for u in find_units(fleet, out) if u.name == "u-3")
    assert read_stored(out, unit)["error"] == "killed its worker 3 times"
    own = {NAME, result_path(out, unit).name}
    assert {n: c for n, c in files(out).items() if n not in own} == {n: c for n, c in undisturbed.items() if n not in own}
    assert counts(run(two_workers, fleet, out)[1]) == {"kept": UNITS - 1, "done": 1} and files(out) == undisturbed


def test_a_full_disk_is_said_and_what_was_kept_stays(two_workers, small_disk, tmp_path):
    room, _ = small_disk
    fleet, out = make_fleet(tmp_path / "fleet", 8), room / "out"
    ballast = room / "ballast"
    ballast.write_bytes(b"x" * 236_000)
    with pytest.raises(BadInput, match=r"No space left.* units are kept and the same command goes on") as told:
        run(two_workers, fleet, out)
    kept = sum(read_stored(out, unit) is not None for unit in find_units(fleet, out))
    assert kept < 8 and "of 8 units" in str(told.value)
    ballast.unlink()
    _, tally = run(two_workers, fleet, out)
    assert tally.counts["done"] > 0 and tally.counts["kept"] >= kept and tally.finished == 8
    assert not list((out / "units").glob(".*"))


def test_a_worker_of_another_version_is_said(two_workers, fleet, tmp_path):
    with pytest.raises(BadInput, match="workers of version 0.0.9"):
        run(two_workers, fleet, tmp_path / "out", version="0.0.9")


def test_a_scheduler_that_goes_away_is_said_and_what_was_kept_stays(fleet, tmp_path):
    out = tmp_path / "out"
    with started([sys.executable, "-c", CLUSTER]) as other:
        address, kept = other.stdout.readline().strip(), []

        def note(text, share):
            kept.append(share)
            other.kill()

        with cluster.joined(address) as client, pytest.raises(BadInput, match="scheduler went away; . of 6 units are kept"):
            run(client, fleet, out, Read(seconds=0.2), note=note)
    assert kept and sum(read_stored(out, unit) is not None for unit in find_units(fleet, out)) >= len(kept)


@pytest.mark.skipif(shutil.which("openssl") is None, reason="certificates are made with openssl")
def test_a_scheduler_that_speaks_tls_is_joined_with_its_files_and_not_without(fleet, tmp_path, undisturbed, monkeypatch):
    ca, key = tmp_path / "ca.pem", tmp_path / "key.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=127.0.0.1", "-days", "2"]
    subprocess.run([*command, "-keyout", str(key), "-out", str(ca)], check=True, capture_output=True)
    monkeypatch.setattr(cluster, "WAIT_S", 5)
    with started([sys.executable, "-c", TLS_CLUSTER, str(ca), str(key)]) as other:
        address = other.stdout.readline().strip()
        assert address.startswith("tls://")
        with pytest.raises(BadInput, match="a running scheduler"), cluster.joined(address):
            pass
        with cluster.joined(address, cluster.Tls(str(ca), str(ca), str(key))) as client:
            out, tally = run(client, fleet, tmp_path / "out")
        other.stdin.close()
    assert counts(tally) == {"done": UNITS} and files(out) == undisturbed


def test_a_thread_that_starts_late_is_waited_for(monkeypatch):
    """On a busy machine: dask gives up a thread of its own after ten seconds, on an assertion."""
    start, real = cluster.event_loop.__wrapped__, asyncio.run
    monkeypatch.setattr(asyncio, "run", lambda main: (time.sleep(0.3), real(main)))
    monkeypatch.setattr(cluster, "LOOP_WAIT_S", 0.05)
    with pytest.raises(BadInput, match="a thread that starts within"):
        start()
    monkeypatch.setattr(cluster, "LOOP_WAIT_S", 30)
    assert start().asyncio_loop.is_running()


def test_no_thread_is_left_to_dask(two_workers, monkeypatch):
    from distributed.utils import LoopRunner

    assert two_workers.loop is two_workers.cluster.loop is cluster.event_loop()
    monkeypatch.setattr(LoopRunner, "_real_stop", lambda *_: pytest.fail("dask started a loop of its own"))
    with cluster.joined(two_workers.scheduler.address) as client:
        assert client.loop is cluster.event_loop()


def test_a_scheduler_that_is_not_there_is_said(monkeypatch):
    monkeypatch.setattr(cluster, "WAIT_S", 1)
    for address in ("tcp://127.0.0.1:9", "nonsense", "ftp://x:1"):
        with pytest.raises(BadInput, match="a running scheduler"), cluster.joined(address):
            pass


def test_a_scheduler_without_workers_is_said(monkeypatch):
    monkeypatch.setattr(cluster, "WAIT_S", 1)
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0", loop=cluster.event_loop()) as empty:
        with pytest.raises(BadInput, match="a scheduler with workers"), cluster.joined(empty.scheduler_address):
            pass


def test_a_run_that_is_killed_twice_goes_on_where_it_stood(fleet, tmp_path, two_workers, undisturbed):
    out = tmp_path / "out"
    for least in (1, 3):
        with started([sys.executable, "-c", RUN, str(fleet), str(out)]) as running:
            for text in running.stdout:
                if int(text.split()[0]) >= least and "units/min" in text:
                    break
            running.kill()
    units = find_units(fleet, out)
    before = sum(read_stored(out, unit) is not None for unit in units)
    _, tally = run(two_workers, fleet, out)
    assert 3 <= before < UNITS and tally.counts["kept"] >= before and files(out) == undisturbed
    assert sorted(p.name for p in (out / "units").iterdir()) == sorted(result_path(out, u).name for u in units)


def test_workers_that_die_while_they_start_are_replaced(fleet, tmp_path, two_workers, undisturbed):
    keepers = two_workers.cluster.workers
    first = {name: keeper.pid for name, keeper in keepers.items()}
    for pid in first.values():
        os.kill(pid, signal.SIGKILL)
    again, deadline = set(), time.monotonic() + 20
    while len(again) < 2 and time.monotonic() < deadline:
        for name, keeper in list(keepers.items()):
            if keeper.pid not in (None, first[name]) and name not in again:
                os.kill(keeper.pid, signal.SIGKILL)
                again.add(name)
    assert len(again) == 2
    out, tally = run(two_workers, fleet, tmp_path / "out")
    assert_each_once(tally)
    assert files(out) == undisturbed
    two_workers.wait_for_workers(2, timeout=30)


def test_workers_that_are_given_up_are_started_anew(two_workers):
    """Dask gives a worker up where it dies at the wrong moment of its start."""
    keepers = two_workers.cluster.workers
    given_up = list(keepers.values())  # one may have been replaced before the other is closed
    for keeper in given_up:
        two_workers.cluster.sync(keeper.close)
    assert len(given_up) == 2 and not any(keeper.status.name == "running" for keeper in given_up)
    assert until(lambda: len(at_work(two_workers)) == 2)
    assert not set(given_up) & set(keepers.values())
    two_workers.wait_for_workers(2, timeout=30)


def test_results_that_are_lost_with_their_worker_are_asked_for_again(fleet, tmp_path, two_workers, undisturbed):
    killed, units = [], find_units(fleet, tmp_path / "out")

    def note(text, share):
        if not killed:  # the others are done meanwhile; what they came to lies with the workers
            assert until(lambda: all(result_path(tmp_path / "out", unit).exists() for unit in units))
            killed.extend(two_workers.run(os.getpid).values())
            for pid in killed:
                os.kill(pid, signal.SIGKILL)
            time.sleep(0.5)

    out, tally = run(two_workers, fleet, tmp_path / "out", note=note)
    assert_each_once(tally)
    assert len(killed) == 2 and tally.counts["kept"] > 0 and files(out) == undisturbed


def test_workers_killed_at_random_moments_lose_nothing(fleet, tmp_path, two_workers, undisturbed):
    stop = threading.Event()

    def kill():
        for _ in range(2):
            time.sleep(0.4)
            pids = two_workers.run(os.getpid)
            if not stop.is_set() and pids:
                os.kill(next(iter(pids.values())), signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    out, tally = run(two_workers, fleet, tmp_path / "out", Read(seconds=0.3))
    stop.set()
    killer.join()
    assert_each_once(tally)
    assert files(out) == undisturbed


def started(command):
    path = os.pathsep.join([*(p for p in sys.path if p.endswith("tests")), os.environ.get("PYTHONPATH", "")])
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, **pipes, env=os.environ | {"PYTHONPATH": path})
