"""Which units a fleet has, their names, and what tells that one changed."""

import os

import pytest
from support.fleet_units import make_unit

from backdrive_bayes.errors import BadInput
from backdrive_bayes.fleet.units import LOCK, FleetUnit, find_units


def names(folder, out=None):
    return [unit.name for unit in find_units(folder, out or folder / "out")]


def test_unit_folders_and_lone_records_are_found_in_order(tmp_path):
    for path in ("b/u", "a/u", "a/deep/er/u", ".hidden/u", "out/u"):
        make_unit(tmp_path / path)
    (tmp_path / "lone.csv").write_text("x")
    (tmp_path / "notes.txt").write_text("x")
    assert names(tmp_path) == ["a/deep/er/u", "a/u", "b/u", "lone.csv"]


def test_the_table_of_a_fleet_is_no_unit(tmp_path):
    """The same command, twice in the fleet's own folder, and once beside an output of before."""
    make_unit(tmp_path / "u")
    for place in (tmp_path, tmp_path / "before"):
        place.mkdir(exist_ok=True)
        (place / LOCK).write_text("")
        (place / "fleet.parquet").write_bytes(b"PAR1")
        assert names(tmp_path, tmp_path) == names(tmp_path, tmp_path / "judged") == ["u"]


def test_a_prediction_beside_units_is_no_unit(tmp_path):
    make_unit(tmp_path / "u")
    (tmp_path / "predicted").mkdir()
    for name in ("prediction.json", "prediction.csv"):
        (tmp_path / "predicted" / name).write_text("{}")
    (tmp_path / "lone.csv").write_text("x")
    (tmp_path / "check.json").write_text("{}")
    assert names(tmp_path) == ["lone.csv", "u"], "a record beside another result stays one"


def test_links_to_units_count_and_links_to_folders_are_not_followed(tmp_path):
    elsewhere, fleet = make_unit(tmp_path / "elsewhere" / "u").parent, tmp_path / "fleet"
    make_unit(fleet / "a")
    (fleet / "b").symlink_to(elsewhere / "u")
    (fleet / "c").symlink_to(elsewhere)
    (fleet / "round").symlink_to(fleet)
    assert names(fleet) == ["a", "b"]


def test_a_folder_that_is_a_unit_is_a_fleet_of_one(tmp_path):
    unit = make_unit(tmp_path / "u")
    assert [u.path for u in find_units(unit, tmp_path / "out")] == [unit]
    with pytest.raises(BadInput, match="outside of units"):
        find_units(unit, unit / "out")


@pytest.mark.parametrize("make", [lambda p: p.mkdir(), lambda p: p.write_text(""), lambda p: None])
def test_a_folder_without_units_is_said(tmp_path, make):
    make(tmp_path / "x")
    with pytest.raises(BadInput, match="units"):
        find_units(tmp_path / "x", tmp_path / "out")


def test_equal_names_in_two_folders_have_two_keys(tmp_path):
    keys = {FleetUnit(name, tmp_path).key for name in ("a/u", "b/u", "a-u", "ä/u", "…/u", "x" * 300)}
    assert len(keys) == 6 and all("/" not in key and len(key) < 80 for key in keys)


def test_a_name_that_is_no_unicode_is_spelt_out(tmp_path):
    make_unit(tmp_path / "fleet" / "u")
    try:
        os.rename(tmp_path / "fleet" / "u", os.fsencode(tmp_path / "fleet") + b"/caf\xe9")
    except OSError:
        pytest.skip("this file system takes no such name")
    assert names(tmp_path / "fleet", tmp_path) == ["caf\\xe9"]


def test_a_change_of_any_file_is_seen_and_a_move_of_the_fleet_is_not(tmp_path):
    unit = FleetUnit("u", make_unit(tmp_path / "u"))
    first = unit.digest()
    assert first == FleetUnit("u", make_unit(tmp_path / "elsewhere" / "u")).digest()
    text = (unit.path / "unit.toml").read_text()
    (unit.path / "unit.toml").write_text(text.replace("1.0", "1.1"))
    changed = unit.digest()
    (unit.path / "a.csv").rename(unit.path / "b.csv")
    assert len({first, changed, unit.digest()}) == 3
    (unit.path / "b.csv").unlink()
    (unit.path / "unit.toml").unlink()
    unit.path.rmdir()
    assert unit.digest() is None
