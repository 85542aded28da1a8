import numpy as np
import pytest

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.columns import DEFAULT_COLUMNS, find_column
from backdrive_bayes.records.quantities import UNITS, labelled, parse_quantity


@pytest.mark.parametrize(
    "spelling, kind, name, factor",
    [
        ("time_s", "time", "time", 1.0),
        ("t [ms]", "time", "t", 1e-3),
        ("t [µs]", "time", "t", 1e-6),
        ("torque_mNm", "torque", "torque", 1e-3),
        ("M [N·m]", "torque", "M", 1.0),
        ("M [mN·m]", "torque", "M", 1e-3),
        ("M [N.m]", "torque", "M", 1.0),
        ("M [N m]", "torque", "M", 1.0),
        ("M (kNm)", "torque", "M", 1e3),
        ("load_torque_Ncm", "torque", "load_torque", 1e-2),
        ("TORQUE [Nm]", "torque", "TORQUE", 1.0),
        ("phi [deg]", "angle", "phi", np.pi / 180),
        ("phi [°]", "angle", "phi", np.pi / 180),
        ("phi [']", "angle", "phi", np.pi / 10800),
        ("phi [′]", "angle", "phi", np.pi / 10800),
        ("angle_arcsec", "angle", "angle", np.pi / 648000),
        ("angle_urad", "angle", "angle", 1e-6),
        ("POSITION [rev]", "angle", "POSITION", 2 * np.pi),
    ],
)
def test_name_and_factor(spelling, kind, name, factor):
    quantity = parse_quantity(spelling, kind, "here")
    assert quantity.name == name
    assert quantity.to_si == pytest.approx(factor, rel=1e-15)


@pytest.mark.parametrize("kind", UNITS)
def test_every_unit_reads_as_suffix_and_in_brackets(kind):
    for unit, factor in UNITS[kind].items():
        assert parse_quantity(f"x_{unit}", kind, "here").to_si == factor
        assert parse_quantity(f"x [{unit}]", kind, "here").to_si == factor


@pytest.mark.parametrize(
    "spelling, kind, hint",
    [
        ("M [lbf]", "torque", "N"),
        ("torque", "torque", "'torque'"),
        ("M [nm]", "torque", "did you mean Nm?"),
        ("phi [arcmins]", "angle", "did you mean arcmin?"),
        ("Winkel [Grad]", "angle", "did you mean deg?"),
        ("phi [Nm]", "angle", "rad"),
        ("M []", "torque", "M []"),
    ],
)
def test_unknown_unit_is_one_clear_line(spelling, kind, hint):
    with pytest.raises(BadInput, match="unit") as error:
        parse_quantity(spelling, kind, "unit.toml")
    assert hint in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "headers, kind, asked, found, unit",
    [
        (("TIME", "TORQUE"), "torque", "TORQUE [Nm]", "TORQUE", "Nm"),
        (("TORQUE [Nm]", "TORQUE"), "torque", "TORQUE [Nm]", "TORQUE [Nm]", "Nm"),
        (("M [mNm]",), "torque", "M", "M [mNm]", "mNm"),
        (("M (mNm)",), "torque", "M [mNm]", "M (mNm)", "mNm"),
        (("torque_Nm", "torque_raw"), "torque", None, "torque_Nm", "Nm"),
        (("Torque [mNm]",), "torque", None, "Torque [mNm]", "mNm"),
        (("angle_deg",), "angle", None, "angle_deg", "deg"),
    ],
)
def test_column_is_found_with_brackets_on_either_side(headers, kind, asked, found, unit):
    header, quantity = find_column(headers, kind, asked, "here")
    assert (header, quantity.unit) == (found, unit)


def test_contradicting_units_are_refused():
    with pytest.raises(BadInput, match="one unit"):
        find_column(("M [Nm]",), "torque", "M [mNm]", "here")


def test_missing_and_ambiguous_columns_are_refused():
    with pytest.raises(BadInput, match="torque_Nm.*found columns 'a', 'b'"):
        find_column(("a", "b"), "torque", None, "here")
    with pytest.raises(BadInput, match="found 2"):
        find_column(("torque_mNm", "torque [Nm]"), "torque", None, "here")


def test_defaults_are_those_of_the_contract():
    assert DEFAULT_COLUMNS == {"time": "time_s", "torque": "torque_Nm", "angle": "angle_arcmin"}


def test_a_bare_slash_parts_groups_from_channels_and_leaves_the_unit_of_the_file():
    assert labelled("Encoder/rev", "deg") == "Encoder/rev [deg]" and labelled("Stats/min", "Nm") == "Stats/min [Nm]"
    assert labelled("Moment in mNm", "Nm") == "Moment in mNm"
    with pytest.raises(BadInput):
        parse_quantity("Time/min", "time", "r.csv")
