"""The Parquet table: what result files hold, a row a unit and record, with a type a column."""

import contextlib
import json

import pytest
from support.fleet_units import row

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet.store import DONE, FAILED, locked, read_stored, result_path, write_result
from backdrive_bayes.fleet.summary import collect, summarise
from backdrive_bayes.fleet.table import NAME, RECORDS, compact
from backdrive_bayes.fleet.units import FleetUnit

parquet = pytest.importorskip("pyarrow.parquet", reason="the extra fleet is not installed")
STAMP = {"files_sha256": "f", "version": "1", "seed": 3, "options": {}}


@pytest.fixture
def out(tmp_path):
    with locked(tmp_path / "out"):
        pass
    return tmp_path / "out"


def kept(out, tmp_path, results):
    units = [FleetUnit(name, tmp_path / name) for name in results]
    for unit in units:
        rows = results[unit.name]
        told = (FAILED, rows, []) if isinstance(rows, str) else (DONE, None, rows)
        write_result(out, unit, STAMP, *told)
    return units


def test_a_row_a_unit_is_that_of_its_largest_loop(out, tmp_path):
    loops = ((1.0, 0.5, "small"), (2.0, 1.0, "fast"), (0.5, 1.001, "slow"))
    rows = [row("b", file=file, loading_rate_Nm_per_s=rate, amplitude_Nm=amplitude) for rate, amplitude, file in loops]
    assert compact(out, kept(out, tmp_path, {"b": rows, "a": "no cycle"})) == 2
    table = parquet.read_table(out / NAME).to_pylist()
    assert [(r["unit"], r["file"], r["records"]) for r in table] == [("b", "slow", 3), ("a", None, 0)]


def test_a_row_a_record_and_one_for_an_error(out, tmp_path):
    units = kept(out, tmp_path, {"b": [row("b", 1, file="1.csv"), row("b", 2.5, file="2.csv")], "a": "no cycle"})
    assert compact(out, units) == 2
    table = parquet.read_table(out / RECORDS).to_pylist()
    assert [(r["unit"], r["file"], r["status"], r["error"]) for r in table] == [
        ("b", "1.csv", "done", None), ("b", "2.csv", "done", None), ("a", None, "failed", "no cycle"),
    ]  # fmt: skip
    assert [r["lost_motion_rad"] for r in table] == [1.0, 2.5, None] and table[0]["seed"] == 3
    assert all(json.loads((out / r["result"]).read_text())["unit"] == r["unit"] for r in table)


def test_columns_have_the_types_of_their_values(out, tmp_path):
    compact(out, kept(out, tmp_path, {"u": [row("u", 1, evaluations=12)], "v": [row("v", 0.5, evaluations=7, serial="A7")]}))
    schema = parquet.read_schema(out / NAME)
    wanted = {"lost_motion_rad": "double", "evaluations": "int64", "converged": "bool", "serial": "string", "verdict": "string"}
    assert {name: str(schema.field(name).type) for name in wanted} == wanted


def test_every_number_is_that_of_the_result_file(out, tmp_path):
    units = kept(out, tmp_path, {f"u{i}": [row(f"u{i}", 0.1 * i)] for i in range(40)})
    compact(out, units)
    table = parquet.read_table(out / NAME).to_pylist()
    for unit, found in zip(units, table, strict=True):
        saved = read_stored(out, unit)["rows"][0]
        assert {key: found[key] for key in saved} == saved


def test_a_table_that_has_no_room_is_said_and_the_old_one_stays(small_disk, tmp_path):
    room, _ = small_disk
    with locked(room / "out"):
        units = kept(room / "out", tmp_path, {"u": [row("u")], "v": [row("v")]})
        compact(room / "out", units[:1])
        before = (room / "out" / NAME).read_bytes()
        with contextlib.suppress(OSError), open(room / "ballast", "wb", buffering=0) as ballast:
            while ballast.write(b"x" * 4096):
                pass
        with pytest.raises(BadInput, match="room for the table.*No space left"):
            compact(room / "out", units)
        assert (room / "out" / NAME).read_bytes() == before and not list((room / "out").glob("*.part"))


def test_results_of_units_that_are_no_more_stay_out(out, tmp_path):
    units = kept(out, tmp_path, {"u": [row("u")], "gone": [row("gone")]})
    assert compact(out, units[:1]) == 1 and result_path(out, units[1]).exists()


def test_hashes_are_one_a_record(out, tmp_path):
    """Those of several records were one word with commas."""
    (unit,) = kept(out, tmp_path, {"b": [row("b", data_sha256="1,2", file="1.csv"), row("b", data_sha256="1,2", file="2.csv")]})
    assert read_stored(out, unit)["data_sha256"] == ["1", "2"]
    assert summarise(collect(out, [unit]))["data_sha256"] == ["1", "2"]
