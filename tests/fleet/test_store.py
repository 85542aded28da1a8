"""The output folder: whole files or none, unreadable ones are as good as none, and one fleet at a time."""

import os
import signal
import subprocess
import sys

import pytest

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet.store import (
    DONE,
    LOCK,
    UNITS,
    CannotKeep,
    locked,
    read_stored,
    result_path,
    write_result,
    write_whole,
)
from backdrive_bayes.fleet.units import FleetUnit

STAMP = {"files_sha256": "f", "version": "1", "seed": 0, "options": {}}
HOLD = "import sys; from backdrive_bayes.fleet.store import locked\nwith locked(sys.argv[1]): print('held', flush=True); input()"


@pytest.fixture
def unit(tmp_path):
    return FleetUnit("a/u", tmp_path / "a" / "u")


@pytest.fixture
def out(tmp_path):
    with locked(tmp_path / "out"):
        pass
    return tmp_path / "out"


def test_what_is_kept_is_read_again(out, unit):
    write_result(out, unit, STAMP, DONE, None, [{"name": "u", "data_sha256": "d", "x": 0.1}])
    found = read_stored(out, unit)
    assert found["rows"] == [{"name": "u", "data_sha256": "d", "x": 0.1}] and found["data_sha256"] == ["d"]
    assert {key: found[key] for key in STAMP} == STAMP and (found["unit"], found["status"]) == ("a/u", DONE)


DAMAGES = {
    "cut": lambda b: b[: len(b) // 2],
    "empty": lambda b: b"",
    "a list": lambda b: b"[]",
    "another unit": lambda b: b.replace(b"a/u", b"a/v"),
    "another schema": lambda b: b.replace(b"fleet-unit/1", b"fleet-unit/9"),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_result_is_none(out, unit, damage):
    write_result(out, unit, STAMP, DONE, None, [{"name": "u"}])
    path = result_path(out, unit)
    path.write_bytes(damage(path.read_bytes()))
    assert read_stored(out, unit) is None


def test_a_name_that_is_no_unicode_is_kept(out, tmp_path):
    unit = FleetUnit("caf\\xe9", tmp_path)
    write_result(out, unit, STAMP, "failed", "file 'caf\udce9.csv'", [])
    assert read_stored(out, unit)["error"] == "file 'caf\udce9.csv'"


def test_what_cannot_be_written_leaves_nothing(out, unit, small_disk):
    room, _ = small_disk
    with pytest.raises(CannotKeep, match="[Nn]o space"):
        write_whole(room / "x.json", b"x" * 1_000_000)
    assert not list(room.iterdir())
    write_whole(room / "x.json", b"x")
    assert (room / "x.json").read_bytes() == b"x"


def test_an_output_that_is_read_only_is_said(small_disk):
    room, remount = small_disk
    remount()
    with pytest.raises(BadInput, match="[Rr]ead-only"), locked(room / "out"):
        pass


def test_a_file_in_the_way_is_said(tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(BadInput, match="a folder to write into"), locked(tmp_path / "out"):
        pass


def test_two_fleets_do_not_share_an_output(out):
    with locked(out), pytest.raises(BadInput, match="another fleet"), locked(out):
        pass
    with locked(out):
        assert (out / LOCK).exists()


def test_an_output_is_given_up_while_a_copy_of_its_handle_is_open(out):
    """A worker that is being born inherits what its parent has open."""
    with locked(out):
        lock = str((out / LOCK).resolve())
        (handle,) = [int(name) for name in os.listdir("/proc/self/fd") if os.path.realpath(f"/proc/self/fd/{name}") == lock]
        copy = os.dup(handle)
    with locked(out):
        os.close(copy)


def test_a_killed_fleet_gives_the_output_up_and_its_pieces_go(out):
    command = [sys.executable, "-c", HOLD, str(out)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(BadInput, match="another fleet"), locked(out):
            pass
        piece = out / UNITS / ".u.json.0123.part"
        piece.write_text("{")
        holder.send_signal(signal.SIGKILL)
        holder.wait()
    with locked(out):
        assert not piece.exists()
