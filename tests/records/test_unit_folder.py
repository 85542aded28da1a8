import gzip
import hashlib
import lzma
import os

import nptdms
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from conftest import answer, ramps, write_csv
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from backdrive_bayes.errors import BadInput
from backdrive_bayes.records.quantities import UNITS
from backdrive_bayes.records.unit_folder import read_unit

ARCMIN = np.pi / 10800
TIME, TORQUE = ramps(noise=0.002)
ANGLE = answer(TORQUE)
COLUMNS = {"time_s": TIME, "torque_Nm": TORQUE, "angle_arcmin": ANGLE / ARCMIN}


def parquet(path):
    pyarrow.parquet.write_table(pyarrow.table(COLUMNS), path)


def tdms(path):
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("bench", name, data) for name, data in COLUMNS.items()])


def mat(path):
    from scipy.io import savemat

    savemat(path, COLUMNS, do_compression=True)


def mat73(path):
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, data in COLUMNS.items():
            file[name] = data[None, :]


def gz(path):
    write_csv(path, *COLUMNS.values())


def xz(path):
    write_csv(path.with_suffix(""), *COLUMNS.values())
    path.write_bytes(lzma.compress(path.with_suffix("").read_bytes()))


@pytest.mark.parametrize(
    "name, write",
    [
        ("a.csv", gz),
        ("a.csv.gz", gz),
        ("a.csv.xz", xz),
        ("a.parquet", parquet),
        ("a.tdms", tdms),
        ("a.mat", mat),
        ("b.mat", mat73),
    ],
)
def test_every_format_reads_alike(tmp_path, name, write):
    write(tmp_path / name)
    unit = read_unit(tmp_path / name)
    (record,) = unit.records
    assert unit.name == name[0] and record.name == name
    assert record.time_s == pytest.approx(TIME, abs=1e-9)
    assert record.torque_nm == pytest.approx(TORQUE, abs=1e-6)
    assert record.angle_rad == pytest.approx(ANGLE, abs=1e-9)
    assert all(values.dtype == np.float64 for values in (record.time_s, record.torque_nm, record.angle_rad))


def test_bare_file_takes_its_largest_torque_and_says_so(unit_folder):
    unit = read_unit(unit_folder / "a.csv")
    assert unit.rated_torque_nm == np.abs(unit.records[0].torque_nm).max()
    assert "largest torque" in unit.notes[0]


def test_largest_torque_of_a_bare_file_is_no_spike(unit_folder):
    lines = (unit_folder / "a.csv").read_text().splitlines()
    time, _, angle = lines[500].split(",")
    lines[500] = f"{time},1e9,{angle}"
    (unit_folder / "a.csv").write_text("\n".join(lines))
    assert read_unit(unit_folder / "a.csv").rated_torque_nm < 1.1


def test_unit_file_is_read_whole(unit_folder):
    toml = unit_folder / "unit.toml"
    head = 'serial = "#7"\ntest_date = 2024-05-06\nreduction_ratio = 64\nlimits = [1, 2]\n'
    text = head + toml.read_text() + "loading_rate_Nm_per_s = 1\namplitude_Nm = 1.0\n"
    toml.write_text(text)
    unit = read_unit(unit_folder)
    assert (unit.name, unit.rated_torque_nm, unit.reduction_ratio) == ("u", 1.0, 64.0)
    assert unit.identity == {"serial": "#7", "test_date": "2024-05-06"}
    assert "limits" in unit.notes[0]
    assert (unit.records[0].loading_rate_nm_per_s, unit.records[0].amplitude_nm) == (1.0, 1.0)
    digests = [hashlib.sha256(content).hexdigest() for content in (text.encode(), (unit_folder / "a.csv").read_bytes())]
    assert [unit.file_sha256, *unit.data_sha256] == digests
    assert read_unit(toml).data_sha256 == unit.data_sha256


@given(
    units=st.tuples(*(st.sampled_from(sorted(UNITS[kind])) for kind in ("time", "torque", "angle"))),
    bracketed=st.booleans(),
    order=st.permutations([0, 1, 2]),
    separator=st.sampled_from([",", ";", "\t"]),
)
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_units_and_spellings_round_trip(tmp_path, units, bracketed, order, separator):
    kinds = ("time", "torque", "angle")
    form = "{} [{}]" if bracketed else "{}_{}"
    names = [form.format(kind, unit).replace('"', "arcsec") for kind, unit in zip(kinds, units, strict=True)]
    factors = [UNITS[kind][unit] for kind, unit in zip(kinds, units, strict=True)]
    values = [si / factor for si, factor in zip((TIME, TORQUE, ANGLE), factors, strict=True)]
    rows = [[f"{values[k][i]:.12g}" for k in order] for i in range(len(TIME))]
    lines = [separator.join(names[k] for k in order), *(separator.join(row) for row in rows)]
    (tmp_path / "r.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    record = read_unit(tmp_path / "r.csv").records[0]
    for got, expected in zip(
        (record.time_s, record.torque_nm, record.angle_rad), (TIME, TORQUE, ANGLE), strict=True
    ):
        assert got == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings_and_decimal_commas(tmp_path, encoding):
    rows = [f"{t:.3f};{q:.6f};{a / (np.pi / 180):.8f}" for t, q, a in zip(TIME, TORQUE, ANGLE, strict=True)]
    text = "\r\n".join(["time [s];torque [Nm];angle [°]", *(row.replace(".", ",") for row in rows), "", ""])
    (tmp_path / "r.csv").write_bytes(text.encode(encoding))
    record = read_unit(tmp_path / "r.csv").records[0]
    assert record.torque_nm == pytest.approx(TORQUE, abs=1e-6)
    assert record.angle_rad == pytest.approx(ANGLE, abs=1e-9)
    assert bool(record.notes) == (encoding in ("utf-16", "cp1252"))


def test_coarse_clock_is_retimed_and_said_so(tmp_path):
    time, torque = ramps(hertz=437.0)
    write_csv(tmp_path / "r.csv", np.floor(time / 0.016) * 0.016, torque, answer(torque) / ARCMIN)
    record = read_unit(tmp_path / "r.csv").records[0]
    assert "re-timed by index" in record.notes[0]
    steps = np.diff(record.time_s)
    assert steps.min() > 0.0 and np.ptp(steps) < 1e-6 * steps.mean()
    assert steps.mean() == pytest.approx(1 / 437.0, rel=0.01)


def test_drifting_coarse_clock_and_gap_are_kept(tmp_path):
    true = np.cumsum(np.r_[0.0, np.linspace(0.0018, 0.0026, 1000), 0.5, np.full(900, 0.0022)])
    torque = np.interp(true, [0, 1, 3, true[-1]], [0, 1, -1, 0.8])
    write_csv(tmp_path / "r.csv", np.floor(true / 0.016) * 0.016, torque, answer(torque) / ARCMIN)
    record = read_unit(tmp_path / "r.csv").records[0]
    assert np.abs(record.time_s - true + 0.008).max() < 0.02
    assert np.all(np.diff(record.time_s) > 0.0)


def test_uneven_strictly_rising_time_is_left_alone(tmp_path):
    keep = np.sort(np.random.default_rng(0).choice(len(TIME), 700, replace=False))
    write_csv(tmp_path / "r.csv", TIME[keep], TORQUE[keep], ANGLE[keep] / ARCMIN)
    record = read_unit(tmp_path / "r.csv").records[0]
    assert record.time_s == pytest.approx(TIME[keep], abs=1e-9) and record.notes == ()


def test_link_inside_the_folder_is_allowed_and_outside_refused(unit_folder, tmp_path):
    os.rename(unit_folder / "a.csv", unit_folder / "b.csv")
    os.symlink("b.csv", unit_folder / "a.csv")
    assert read_unit(unit_folder).name == "u"
    os.rename(unit_folder / "b.csv", tmp_path / "b.csv")
    (unit_folder / "a.csv").unlink()
    os.symlink(tmp_path / "b.csv", unit_folder / "a.csv")
    with pytest.raises(BadInput, match="inside the unit folder"):
        read_unit(unit_folder)


def test_row_numbers_are_those_of_the_file(tmp_path):
    lines = write_csv(tmp_path / "r.csv", *COLUMNS.values()).read_text().splitlines()
    lines[41] = lines[41].replace(",", ",x", 1)
    (tmp_path / "r.csv").write_text("\n".join(lines))
    with pytest.raises(BadInput, match="row 42, column 'torque_Nm'"):
        read_unit(tmp_path / "r.csv")


def test_broken_archive_is_one_line(tmp_path):
    data = gzip.compress(b"time_s,torque_Nm,angle_arcmin\n" + b"0.1,0.2,0.3\n" * 5000)
    (tmp_path / "r.csv.gz").write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match="intact compressed file"):
        read_unit(tmp_path / "r.csv.gz")


def test_shared_units_are_read(shared_data):
    unit = read_unit(shared_data / "twins" / "reducer-1")
    assert len(unit.records) == 7 and unit.records[1].notes == ()
    assert unit.records[1].angle_rad[20:].max() == pytest.approx(111.7 * ARCMIN, rel=0.02)
    real = read_unit(shared_data / "cycloidal" / "conic-preload-1")
    assert len(real.records) == 8 and all("re-timed" in record.notes[0] for record in real.records)


@pytest.mark.parametrize(
    "header, row",
    [
        ('time_s,"torque [Nm]",angle_arcmin,remark', '{},"{}",{},"one, two"'),
        ("time_s,torque_Nm,angle_arcmin,remark", "{},{},{},"),
        ("time_s,torque_Nm,angle_arcmin", "{},{},{},"),
        ("remark\ttorque_Nm\tangle_arcmin\ttime_s", "a,b\t{1}\t{2}\t{0}"),
    ],
)
def test_harmless_extra_cells_and_trailing_blanks_are_read(tmp_path, header, row):
    rows = [row.format(*values) for values in zip(*COLUMNS.values(), strict=True)]
    (tmp_path / "r.csv").write_text("\n".join([header, *rows, "", ",,", *12 * [""]]))
    record = read_unit(tmp_path / "r.csv").records[0]
    assert record.torque_nm == pytest.approx(TORQUE, abs=1e-12)
    assert record.time_s == pytest.approx(TIME, abs=1e-12)
