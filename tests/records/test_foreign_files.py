"""Files as other people's benches write them: read, and what was guessed is said; or refused with a line to paste."""

import datetime
import tomllib

import nptdms
import numpy as np
import pytest
from conftest import answer, ramps

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.unit_folder import read_unit

TIME, TORQUE = ramps(noise=0.002)
ANGLE = answer(TORQUE)
DEG = np.degrees(ANGLE)


def rows(separator=",", decimal="."):
    return [
        separator.join(f"{v:.9f}".replace(".", decimal) for v in row) for row in zip(TIME, 1e3 * TORQUE, DEG, strict=True)
    ]


def text(tmp_path, *lines, name="r.csv"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def reads_true(path, *notes):
    record = read_unit(path).records[0]
    said = " | ".join(record.notes)
    assert all(note in said for note in notes), said
    assert record.time_s - record.time_s[0] == pytest.approx(TIME - TIME[0], abs=1e-6)
    assert record.torque_nm == pytest.approx(TORQUE, abs=1e-6)
    assert record.angle_rad == pytest.approx(ANGLE, abs=1e-8)
    return record


GERMAN = ("read 'Zeit [s]' as time in s", "read 'Drehmoment [mNm]' as torque in mN·m", "read 'Winkel [°]' as angle in °")


def test_excel_separator_line_german_names_and_decimal_commas(tmp_path):
    reads_true(text(tmp_path, "sep=;", "Zeit [s];Drehmoment [mNm];Winkel [°]", *rows(";", ",")), *GERMAN)


def test_units_below_the_header(tmp_path):
    lines = ["Zeit;Drehmoment;Winkel", "s;mN·m;deg", *rows(";", ",")]
    reads_true(text(tmp_path, *lines), "read units from a row", "read 'Drehmoment [mN·m]' as torque in mN·m")


def test_preamble_units_and_header(tmp_path):
    preamble = ["Prüfstand 3", "Datum;2024-05-06;10:30", "", "Prüfer: M. Muster, Halle 2", ""]
    lines = [*preamble, "Zeit;Drehmoment;Winkel", "[s];[mNm];[°]", *rows(";", ",")]
    reads_true(text(tmp_path, *lines), "3 lines above the header left out")


@pytest.mark.parametrize(
    ("decimal", "other"), [(",", "03.05.2024 10:00:00.000"), (",", "v1.2.3.4.5"), (".", '"a, b, c, d, e"'), (".", "1,5,2,5")]
)
def test_dates_and_comments_do_not_tell_the_decimal_mark(tmp_path, decimal, other):
    lines = ["Datum;Zeit [s];Drehmoment [mNm];Winkel [°]", *(f"{other};{row}" for row in rows(";", decimal))]
    reads_true(text(tmp_path, *lines), *GERMAN)


def test_rows_are_counted_with_the_preamble(tmp_path):
    lines = ["bench 3", "", "time [s],torque [mNm],angle [deg]", *rows()]
    lines[40] = lines[40].replace(".", "x", 1)
    with pytest.raises(BadInput, match="row 41, column 'time"):
        read_unit(text(tmp_path, *lines))


@pytest.mark.parametrize(
    "header",
    [
        "Temps [s],Couple [mNm],Angle [deg]",
        "t [s],M_out [mN·m],phi [°]",
        "时间 [s],扭矩 [mNm],角度 [deg]",
        "Elapsed (s),Output torque (mN.m),Output angle (deg)",
        "AI0 [s],AI1 [mNm],AI2 [deg]",
    ],
)
def test_common_headers_are_guessed_and_said(tmp_path, header):
    reads_true(text(tmp_path, header, *rows()), "as torque in mN·m")


def test_what_leaves_a_choice_is_refused_with_a_line_to_paste(tmp_path):
    lines = ["Zeit [s];Drehmoment Antrieb [Nm];Drehmoment Abtrieb [mNm];Winkel [°]"]
    lines += [";".join([r.split(";")[0], "1.0", *r.split(";")[1:]]) for r in rows(";")]
    with pytest.raises(BadInput) as error:
        read_unit(text(tmp_path, *lines))
    pasted = tomllib.loads(str(error.value).split("[[record]]: ")[1])
    assert pasted["columns"]["time"] == "Zeit [s]" and pasted["columns"]["angle"] == "Winkel [°]"
    assert "found 2" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("header", ["Zeit,Drehmoment,Winkel", "a,b,c", "time_s,load,angle_deg", "time_s,M [kgf·cm],angle_deg"])
def test_names_without_units_are_not_guessed(tmp_path, header):
    path = text(tmp_path, header, *rows())
    with pytest.raises(BadInput, match=r"under \[\[record\]\]: columns = \{time = .*, torque = .*, angle = .*\}") as error:
        read_unit(path)
    # What is to be pasted leaves the unit to its reader: as it stands it is refused, never read 1000 times too large.
    advice = str(error.value).split("[[record]]: ")[1]
    folder = tmp_path / "unit"
    folder.mkdir()
    (folder / "r.csv").write_bytes(path.read_bytes())
    head = 'schema = "backdrive-bayes/unit/1"\nname = "u"\nrated_torque_Nm = 0.1\n[[record]]\nfile = "r.csv"\n'
    (folder / "unit.toml").write_text(head + advice + "\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"unit|column"):
        read_unit(folder)


@pytest.mark.parametrize(
    "header", ["Zeit in s,Moment in mN m,Winkel in °", "t / s,M / mNm,phi / deg", "Zeit, s;Moment, mNm;Winkel, °"]
)
def test_units_after_a_word_a_slash_or_a_comma_are_read(tmp_path, header):
    mark = ";" if ";" in header else ","
    reads_true(text(tmp_path, header, *rows(mark)), "as torque in mN·m")


@pytest.mark.parametrize("sign", ["-", "−"])
def test_a_leading_minus_turns_any_channel(unit_folder, sign):
    toml = unit_folder / "unit.toml"
    plain = read_unit(unit_folder).records[0]
    toml.write_text(toml.read_text() + f'[record.columns]\ntorque = "{sign}torque_Nm"\nangle = "{sign}angle_arcmin"\n')
    turned = read_unit(unit_folder).records[0]
    assert np.array_equal(turned.torque_nm, -plain.torque_nm) and np.array_equal(turned.angle_rad, -plain.angle_rad)
    assert turned.columns["angle"] == "-angle_arcmin"


def workbook(path, *sheets):
    openpyxl = pytest.importorskip("openpyxl", reason="Excel files need the extra 'readers'")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for title, lines in sheets:
        sheet = book.create_sheet(title)
        for line in lines:
            sheet.append(line)
    book.save(path)
    return path


def test_excel_with_preamble_units_and_a_cover_sheet(tmp_path):
    table = [["Prüfstand", 3], [], ["Zeit", "Drehmoment", "Winkel"], ["s", "mNm", "°"]]
    table += [[float(v) for v in row] for row in zip(TIME, 1e3 * TORQUE, DEG, strict=True)]
    cover = [["Protokoll"], ["Datum", datetime.date(2024, 5, 6)]]
    path = workbook(tmp_path / "r.xlsx", ("Deckblatt", cover), ("Messung", table))
    reads_true(path, "read sheet 'Messung'", "read 'Drehmoment [mNm]' as torque in mN·m")


def test_excel_text_with_decimal_commas(tmp_path):
    table = [["Zeit [s]", "Drehmoment [mNm]", "Winkel [°]"]]
    table += [[f"{v:.9f}".replace(".", ",") for v in row] for row in zip(TIME, 1e3 * TORQUE, DEG, strict=True)]
    reads_true(workbook(tmp_path / "r.xlsx", ("Tabelle1", table)))


@pytest.mark.parametrize("cell, found", [(None, "nothing"), ("n/a", "'n/a'"), (True, "'True'")])
def test_excel_names_the_cell(tmp_path, cell, found):
    table = [["time [s]", "torque [mNm]", "angle [deg]"], *([t, q, a] for t, q, a in zip(TIME, TORQUE, DEG, strict=True))]
    table[7][1] = cell
    with pytest.raises(BadInput, match=f"row 8, column 'torque .mNm.': expected a finite number, found {found}"):
        read_unit(workbook(tmp_path / "r.xlsx", ("a", table)))


def tdms(path, *channels):
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject(*channel) for channel in channels])
    return path


STEP = {"wf_increment": 1 / 200.0, "wf_start_offset": 0.0}


@pytest.mark.parametrize("key", ["unit_string", "NI_UnitDescription"])
def test_tdms_waveforms_bring_time_and_units(tmp_path, key):
    torque = ("bench", "Drehmoment", 1e3 * TORQUE, STEP | {key: "mNm"})
    path = tdms(tmp_path / "r.tdms", torque, ("bench", "Winkel", DEG, STEP | {key: "°"}))
    reads_true(path, "waveforms' properties", "read 'Drehmoment [mNm]' as torque in mN·m")


@pytest.mark.parametrize("late", [0, 100])
def test_tdms_waveforms_that_start_apart_are_laid_on_one_clock(tmp_path, late):
    """The later channel's first sample belongs to its own start. The planted fault is a channel that does not tell when."""
    start = np.datetime64("2024-05-03T10:00:00")
    began = {"wf_start_time": start + np.timedelta64(5 * late, "ms")}
    torque = ("bench", "M [mNm]", 1e3 * TORQUE, STEP | {"wf_start_time": start})
    told = read_unit(tdms(tmp_path / "a.tdms", torque, ("bench", "phi [deg]", DEG[late:], STEP | began))).records[0]
    silent = read_unit(tdms(tmp_path / "b.tdms", torque, ("bench", "phi [deg]", DEG[late:], STEP))).records[0]
    assert told.torque_nm == pytest.approx(TORQUE[late:], abs=1e-6) and told.angle_rad == pytest.approx(ANGLE[late:], abs=1e-8)
    assert (np.abs(silent.torque_nm - TORQUE[late:]).max() > 0.1) == (late > 0)


def test_tdms_of_two_groups_with_a_clock_each(tmp_path):
    slow = slice(0, None, 2)
    path = tdms(
        tmp_path / "r.tdms",
        ("moment", "Zeit [s]", TIME[slow]),
        ("moment", "M [mNm]", 1e3 * answer(TORQUE[slow])),
        ("geber", "Zeit [s]", TIME),
        ("geber", "phi [deg]", DEG),
    )
    record = read_unit(path).records[0]
    assert "'M [mNm]' interpolated to the times of 'phi [deg]'" in " | ".join(record.notes)
    assert len(record.time_s) == len(TIME[TIME <= TIME[slow][-1]])
    assert record.torque_nm[slow] == pytest.approx(answer(TORQUE[slow]), abs=1e-9)


@pytest.mark.parametrize("groups", ["aa", "ab"])
def test_tdms_with_a_clock_of_date_and_time(tmp_path, groups):
    """In one group or two; the planted fault was to take the only one for a column of numbers without a unit."""
    stamps = np.datetime64("2024-05-03T10:00:00", "us") + (1e6 * (TIME - TIME[0])).round().astype("timedelta64[us]")
    torque, angle = ("a", "M [mNm]", 1e3 * TORQUE), (groups[1], "phi [deg]", DEG)
    path = tdms(tmp_path / "r.tdms", *((g, "Time", stamps) for g in sorted(set(groups))), torque, angle)
    reads_true(path, "groups' own channels")


def test_tdms_of_two_groups_on_one_clock(tmp_path):
    channels = [("a", "time_s", TIME), ("a", "torque_mNm", 1e3 * TORQUE), ("b", "time_s", TIME), ("b", "angle_deg", DEG)]
    reads_true(tdms(tmp_path / "r.tdms", *channels), "groups' own channels")


def test_matlab_structures(tmp_path):
    from scipy.io import savemat

    fields = {"time_s": TIME, "torque_mNm": 1e3 * TORQUE, "angle_deg": DEG, "comment": "bench"}
    savemat(tmp_path / "r.mat", {"run": {"data": fields, "n": 3}})
    reads_true(tmp_path / "r.mat")


def test_matlab_73_structures(tmp_path):
    import h5py

    with h5py.File(tmp_path / "r.mat", "w", userblock_size=512) as file:
        for name, data in {"time_s": TIME, "torque_mNm": 1e3 * TORQUE, "angle_deg": DEG}.items():
            file[f"run/data/{name}"] = data[None, :]
    reads_true(tmp_path / "r.mat")


def measurement(path, *groups):
    asammdf = pytest.importorskip("asammdf", reason="MF4 files need the extra 'mdf'")
    with asammdf.MDF(version="4.10") as file:
        for group in groups:
            file.append([asammdf.Signal(v, t, name=name, unit=unit) for name, unit, t, v in group])
        file.save(path, overwrite=True)
    return path


def test_mdf_of_one_group(tmp_path):
    group = [("Drehmoment", "mNm", TIME, 1e3 * TORQUE), ("Winkel", "deg", TIME, DEG)]
    reads_true(measurement(tmp_path / "r.mf4", group), "master channels", "read 'Winkel [deg]' as angle in deg")


def test_mdf_of_two_groups(tmp_path):
    groups = [[("M", "mNm", TIME, 1e3 * TORQUE)], [("phi", "deg", TIME[::2], DEG[::2])]]
    record = read_unit(measurement(tmp_path / "r.mf4", *groups)).records[0]
    assert "interpolated" in " | ".join(record.notes) and record.torque_nm == pytest.approx(TORQUE[::2], abs=1e-9)
