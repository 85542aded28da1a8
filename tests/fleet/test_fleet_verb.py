"""The verb on real fits with a worker killed in their midst: the numbers are those of the single verbs; and its bad input."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from conftest import write_csv
from support.fleet_units import make_fleet
from support.planted import planted
from threadpoolctl import threadpool_limits

from backdrive_bayes.commands.fleet_unit import UnitWork
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.results import FitOptions
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.evidence import Evidence
from backdrive_bayes.decisions.limits import read_limits
from backdrive_bayes.fleet.store import locked

parquet = pytest.importorskip("pyarrow.parquet", reason="the extra fleet is not installed")
pytest.importorskip("distributed", reason="the extra fleet is not installed")
LIMITS = "[loop_area_J]\nmax = 1.0\n[risk]\nconsumer = 0.05\nproducer = 0.05\n"
RAD = 10800 / 3.141592653589793


def write_unit(folder, unit):
    folder.mkdir(parents=True)
    for record in unit.records:
        write_csv(folder / record.name, record.time_s, record.torque_nm, record.angle_rad * RAD)
    files = "".join(f'\n[[record]]\nfile = "{r.name}"\n' for r in unit.records)
    (folder / "unit.toml").write_text(
        f'schema = "backdrive-bayes/unit/1"\nname = "{folder.name}"\nserial = "{folder.name}"\nrated_torque_Nm = 0.1\n{files}'
    )


def workers_of(pid):
    """The worker processes of a running fleet."""
    import psutil

    return [p for p in psutil.Process(pid).children(recursive=True) if "spawn_main" in " ".join(p.cmdline())]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Two small units, and a file that cannot be read."""
    folder = tmp_path_factory.mktemp("fleet")
    for i in (1, 2):
        write_unit(folder / f"u-{i}", planted(i, loops=((0.1, 0.1),)))
    (folder / "bad.csv").write_text("time_s,torque_Nm,angle_arcmin\n1,2,3\n")
    return folder


@pytest.fixture(scope="module")
def out(fleet, tmp_path_factory):
    """Its results; one worker is killed while it works on a unit."""
    out = tmp_path_factory.mktemp("results") / "out"
    command = [sys.executable, "-m", "backdrive_bayes", "fleet", str(fleet), "-o", str(out), "--workers", "2"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as running:
        while running.poll() is None and not list(out.glob("units/*.json")):
            time.sleep(0.1)
        assert running.poll() is None, running.stderr.read()
        time.sleep(0.5)
        os.kill(workers_of(running.pid)[0].pid, signal.SIGKILL)
        told, complaints = running.communicate(timeout=180)
    assert running.returncode == 4 and "Traceback" not in complaints
    assert told.splitlines()[1] == "INCOMPLETE: 1 of 3 units have no result"
    return out


@pytest.fixture(scope="module")
def alone(fleet, tmp_path_factory):
    """The rows and the kept folder of one of the units, worked on in this process on two threads, judged as well."""
    limits = tmp_path_factory.mktemp("limits") / "limits.toml"
    limits.write_text(LIMITS)
    folder = tmp_path_factory.mktemp("alone") / "u-2"
    with threadpool_limits(2, user_api="blas"):
        return UnitWork(FitOptions(), limits=read_limits(limits))(fleet / "u-2", folder), folder, limits


def rows_of(out):
    return {row["unit"]: row for row in parquet.read_table(out / "fleet.parquet").to_pylist()}


def test_the_table_has_every_unit_once_with_its_error_or_its_numbers(out):
    table = rows_of(out)
    assert {name: row["status"] for name, row in table.items()} == {"bad.csv": "failed", "u-1": "done", "u-2": "done"}
    assert "bad.csv" in table["bad.csv"]["error"] and table["u-1"]["converged"]
    assert table["bad.csv"]["error"].startswith("bad.csv"), "where a fleet lies is no part of its results"
    assert json.loads((out / "run.json").read_text())["verb"] == "fleet"
    assert {p.name for p in (out / "figures").iterdir()} >= {"fleet-charts.svg", "fleet-charts.png"}


def test_the_numbers_are_those_of_the_unit_by_itself(out, alone):
    (row,), kept = alone[0], rows_of(out)["u-2"]
    judged = {"answer", "credible_set_90", "gap_probability", "unlisted_probability"}
    judged |= {"verdict", "reason", "conformance_probability", "limiting"}
    assert {k: kept[k] for k in row if k not in judged} == {k: v for k, v in row.items() if k not in judged}
    assert all(kept[k] is None and row[k] is not None for k in judged)


def test_a_kept_folder_is_one_of_the_verbs_and_its_verdict_follows_from_it(alone):
    (row,), folder, limits = alone
    evidence = Evidence.read(folder)
    again, saved = assess([evidence], read_limits(limits)), json.loads((folder / "verdict.json").read_text())
    assert row["verdict"] == again["verdict"] == saved["verdict"] and saved["structure"]["diagnosed"]
    assert row["conformance_probability"] == again["conformance_probability"]
    assert row["answer"] == ("+".join(evidence.diagnosis["answer"]["effects"]) or "none")
    for name, value in evidence.about["records"][0]["indicators"].items():
        assert (row[name], row[f"{name}_lo"], row[f"{name}_hi"]) == (value["median"], value["lo"], value["hi"])


def test_a_second_run_keeps_all_and_changes_nothing(fleet, out, capsys):
    before = {p: p.read_bytes() for p in [out / "fleet.parquet", out / "fleet.json", *out.glob("units/*.json")]}
    assert main(["fleet", str(fleet), "-o", str(out), "--workers", "1", "--no-figures"]) == 4
    assert "(3 were there already)" in capsys.readouterr().out
    assert {p: p.read_bytes() for p in before} == before


@pytest.mark.parametrize(("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")])
def test_an_interrupted_fleet_ends_at_once_with_its_workers_in_one_line(fleet, tmp_path, number, code, word):
    command = [sys.executable, "-m", "backdrive_bayes", "fleet", str(fleet), "-o", str(tmp_path / "out"), "--workers", "2"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes, start_new_session=True) as running:
        assert "2 workers" in running.stdout.readline()
        time.sleep(0.5)
        workers = workers_of(running.pid)
        os.killpg(running.pid, number)  # as a terminal does
        _, complaints = running.communicate(timeout=20)
    assert running.returncode == code and complaints.splitlines()[-1] == f"backdrive-bayes: {word}"
    assert len(workers) == 2 and "Traceback" not in complaints and "Warning" not in complaints
    for worker in workers:
        worker.wait(10)
    assert not list((tmp_path / "out").glob("units/*.part"))


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--workers", "0"], "a number from 1 to 1024"),
        (["--tls-ca", "ca.pem"], "all three"),
        (["--scheduler", "tcp://127.0.0.1:9", "--workers", "2"], "no number of workers"),
        (["--limits", "nowhere.toml"], "nowhere.toml"),
        (["--baseline", "nothing"], "--baseline"),
    ],
)
def test_bad_options_are_one_line_and_leave_nothing(tmp_path, capsys, options, expected):
    fleet = make_fleet(tmp_path / "fleet", 1)
    assert main(["fleet", str(fleet), "-o", str(tmp_path / "out"), *options]) == 2
    told = capsys.readouterr()
    assert expected in told.err and told.err.count("\n") == 1 and not list((tmp_path / "out").rglob("*.json"))


def test_an_output_that_another_fleet_holds_is_one_line(tmp_path, capsys):
    fleet = make_fleet(tmp_path / "fleet", 1)
    with locked(tmp_path / "out"):
        assert main(["fleet", str(fleet), "-o", str(tmp_path / "out")]) == 2
    assert "another fleet is writing to" in capsys.readouterr().err


def test_a_folder_without_units_is_one_line(tmp_path, capsys):
    assert main(["fleet", str(tmp_path), "-o", str(tmp_path / "out")]) == 2
    assert "a folder with units" in capsys.readouterr().err


def test_the_demo_of_a_fleet_ends_in_a_report(tmp_path, capsys):
    """The packaged fleet has a minute of fits; the way is the same for a fleet of one bad file."""
    (tmp_path / "reducer-1").mkdir()
    (tmp_path / "fleet").mkdir()
    (tmp_path / "fleet" / "bad.csv").write_text("")
    assert main(["demo", "--fleet", "--data", str(tmp_path), "-o", str(tmp_path / "out")]) == 4
    assert "synthetic" in capsys.readouterr().out and (tmp_path / "out" / "report.pdf").read_bytes().startswith(b"%PDF")
