"""What `fleet --pool batch` does after its fits: kept posteriors read on the workers, one folder a batch."""

import json
import shutil

import pytest
from support.decided import write_evidence

from backdrive_bayes.commands.fleet_pool import pool_fleet, retire_pools, show_pools
from backdrive_bayes.decisions.pool import Pool
from backdrive_bayes.fleet import cluster
from backdrive_bayes.fleet.store import posterior_folder
from backdrive_bayes.fleet.task import Job
from backdrive_bayes.fleet.units import FleetUnit

pytest.importorskip("distributed", reason="the extra fleet is not installed")
LOOP = ((0.05, 0.1),)
SPRING, AUTUMN = [f"spring/u{i}" for i in range(7)], ["autumn 26/a", "autumn 26/b"]


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """Seven units of one batch, one of them without its posterior, two of another, and one that failed."""
    out = tmp_path_factory.mktemp("out")
    units = [FleetUnit(name, out / name) for name in [*SPRING, *AUTUMN, "spring/bad"]]
    for i, unit in enumerate(units[:-1]):
        write_evidence(posterior_folder(out, unit), unit.name, LOOP, seed=i, size=1 + 0.01 * i)
    shutil.rmtree(posterior_folder(out, units[6]))
    rows = [(u.name, u.key, [{"unit": u.name, "batch": None, "status": "done"}]) for u in units]
    rows[-1][2][0]["status"] = "failed"
    return Job(out, None, seed=5), units, rows


def test_each_batch_has_its_folder_and_says_what_is_missing(fleet, capsys):
    job, units, rows = fleet
    with cluster.local(1) as client:
        written = pool_fleet(job, units, rows, client, 0.9, False, lambda text, share: None)
        show_pools(written)
    assert written == [job.out / "pools" / "spring"]
    told = json.loads((written[0] / "pool.json").read_text())
    assert told["units"] == SPRING[:6] and told["seed"] == 5 and told["version"] == job.version
    assert [row["unit"] for row in told["left_out"]] == [SPRING[6]] and "no such file" in told["left_out"][0]["why"]
    said = capsys.readouterr().out
    assert "not pooled: batch 'autumn 26': expected at least 5 units that can be pooled, found 2 of 2" in said
    assert "batch 'spring': POOLED: " in said and "of 6 units" in said
    area = Pool.read(written[0]).predictive("loop_area_J", 0.05, 0.1, 0.003)
    assert area.units == 6 and area.next_unit["lo"] < area.next_unit["median"] < area.next_unit["hi"]
    retire_pools(job.out)
    assert not (job.out / "pools").exists()
