"""Every kind of bad input: exit code 2, one line on standard error, no traceback, nothing written."""

import gzip
import json
import lzma
import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import answer, ramps, write_csv

from backdrive_bayes.commands.door import collected, ready_unit
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.output import default_out, write_folder, write_json
from backdrive_bayes.decisions.outcome import FORCED
from backdrive_bayes.records.readers import limits
from backdrive_bayes.results import INDICATORS

TIME, TORQUE = ramps(noise=0.002)
ANGLE = answer(TORQUE) * 10800 / np.pi
ENTRY = '\n[[record]]\nfile = "{}"\n'


def edit_toml(folder, old, new):
    path = folder / "unit.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def edit_row(folder, row, change):
    path = folder / "a.csv"
    lines = path.read_text().splitlines()
    lines[row - 1] = change(lines[row - 1])
    path.write_text("\n".join(lines) + "\n")


def cells(row, **changed):
    values = dict(zip(("t", "q", "a"), row.split(","), strict=True)) | changed
    return ",".join(values.values())


def rewrite(folder, time=TIME, torque=TORQUE, angle=ANGLE, **options):
    write_csv(folder / "a.csv", time, torque, angle, **options)


def compressed(folder, suffix, data):
    (folder / f"a.csv.{suffix}").write_bytes(data)
    edit_toml(folder, "a.csv", f"a.csv.{suffix}")


def missing_file(folder):
    (folder / "a.csv").unlink()


def huge_file(folder):
    os.truncate(folder / "a.csv", 2_100_000_000)


def gzip_bomb(folder):
    head = gzip.compress(b"time_s,torque_Nm,angle_arcmin\n")
    compressed(folder, "gz", head + 30 * gzip.compress(b"0,0,0\n" * 500_000))


def xz_bomb(folder):
    head = lzma.compress(b"time_s,torque_Nm,angle_arcmin\n")
    compressed(folder, "xz", head + 30 * lzma.compress(b"0,0,0\n" * 500_000, preset=1))


def mixed_commas(folder):
    rows = [f"{t};{q};{a}".replace(".", ",") for t, q, a in zip(TIME, TORQUE, ANGLE, strict=True)]
    rows[6] = rows[6].replace(",", ".")
    (folder / "a.csv").write_text("\n".join(["time_s;torque_Nm;angle_arcmin", *rows]))


def commas_twice(folder):
    text = (folder / "a.csv").read_text().replace(",", ";").replace(".", ",").replace(";", ",")
    (folder / "a.csv").write_text(text)


def not_text(folder):
    (folder / "a.csv").write_bytes("\n".join((folder / "a.csv").read_text().split()).encode("utf-16-le"))


def outward_link(folder):
    os.rename(folder / "a.csv", folder.parent / "b.csv")
    os.symlink("../b.csv", folder / "a.csv")


def other_parquet(folder):
    (folder / "a.parquet").write_bytes(b"PAR1 nonsense")
    edit_toml(folder, "a.csv", "a.parquet")


def other_tdms(folder):
    (folder / "a.tdms").write_bytes(b"nonsense of some length, certainly no lead-in")
    edit_toml(folder, "a.csv", "a.tdms")


def other_mat(folder):
    (folder / "a.mat").write_bytes(b"nonsense" * 40)
    edit_toml(folder, "a.csv", "a.mat")


def renamed(suffix):
    return lambda folder: (os.rename(folder / "a.csv", folder / f"a.{suffix}"), edit_toml(folder, "a.csv", f"a.{suffix}"))


def flipped_mat(folder):
    from scipy.io import savemat

    savemat(folder / "a.mat", {"time_s": TIME, "torque_Nm": TORQUE, "angle_arcmin": ANGLE})
    data = bytearray((folder / "a.mat").read_bytes())
    data[150:170] = b"\xff" * 20
    (folder / "a.mat").write_bytes(data)
    edit_toml(folder, "a.csv", "a.mat")


CASES = {
    "not Excel": (renamed("xlsx"), ["Excel workbook"]),
    "not MDF": (renamed("mf4"), ["MDF file"]),
    "flipped bytes in MAT": (flipped_mat, ["MATLAB"]),
    "integer of 309 digits": (lambda f: edit_toml(f, "= 1.0", "= 1" + "0" * 308), ["at most 300 digits"]),
    "integer of 5000 digits": (lambda f: edit_toml(f, "= 1.0", "= 1" + "0" * 5000), ["at most 300 digits", "a larger one"]),
    "hexadecimal integer of 9000 digits": (lambda f: edit_toml(f, "= 1.0", "= 0x1" + "0" * 9000), ["at most 300 digits"]),
    "20 000 tables": (
        lambda f: edit_toml(f, "= 1.0", "= 1.0\n" + "[[loop_area_J]]\nmax = 1\n" * 20_000),
        ["at most 1000 entries", "20000"],
    ),
    "deep dotted key": (lambda f: edit_toml(f, "= 1.0", "= 1.0\n" + ".".join("a" * 900) + " = 1"), ["40 tables"]),
    "numbers of 1e308": (lambda f: rewrite(f, torque=1e307 * TORQUE.round(3)), ["below 1e+60"]),
    "years between samples": (lambda f: rewrite(f, time=1e9 * TIME), ["microseconds to years"]),
    "20 samples": (lambda f: rewrite(f, TIME[::50], TORQUE[::50], ANGLE[::50]), ["24 samples or more", "found 21"]),
    "12 samples": (lambda f: rewrite(f, TIME[:12], TORQUE[:12], ANGLE[:12]), ["24 samples or more", "found 12"]),
    "missing record file": (missing_file, ["unit.toml", "record 1", "a.csv", "nothing there"]),
    "missing unit file": (lambda f: (f / "unit.toml").unlink(), ["unit.toml"]),
    "missing key": (
        lambda f: edit_toml(f, "rated_torque_Nm = 1.0\n", ""),
        ["rated_torque_Nm", "no such key"],
    ),
    "missing name": (lambda f: edit_toml(f, 'name = "u"\n', ""), ["key name"]),
    "no record": (lambda f: edit_toml(f, ENTRY.format("a.csv"), ""), ["key record"]),
    "wrong schema": (lambda f: edit_toml(f, "unit/1", "unit/2"), ["schema", "unit/2"]),
    "misspelt key": (
        lambda f: edit_toml(f, "rated_torque_Nm", "rated_torque_nm"),
        ["rated_torque_nm", "did you mean rated_torque_Nm?"],
    ),
    "misspelt record key": (
        lambda f: edit_toml(f, 'file = "a.csv"', 'file = "a.csv"\namplitude = 1.0\namplitude_nm = 1.0'),
        ["did you mean amplitude_Nm?"],
    ),
    "bool for a number": (lambda f: edit_toml(f, "= 1.0", "= true"), ["a positive number", "True"]),
    "text for a number": (lambda f: edit_toml(f, "= 1.0", '= "1"'), ["a positive number", "'1'"]),
    "negative number": (lambda f: edit_toml(f, "= 1.0", "= -1"), ["a positive number", "-1"]),
    "infinite number": (lambda f: edit_toml(f, "= 1.0", "= inf"), ["a positive number", "inf"]),
    "broken TOML": (lambda f: edit_toml(f, "= 1.0", "= = 1"), ["TOML"]),
    "deep TOML": (lambda f: edit_toml(f, "= 1.0", "= " + "[" * 20_000), ["TOML"]),
    "TOML in latin-1": (lambda f: (f / "unit.toml").write_bytes(b'name = "\xe9"'), ["UTF-8"]),
    "duplicate file": (
        lambda f: (f / "unit.toml").write_text((f / "unit.toml").read_text() + ENTRY.format("./a.csv")),
        ["record 2", "each file once"],
    ),
    "path above": (lambda f: edit_toml(f, "a.csv", "../unit/a.csv"), ["inside the unit folder", "../unit"]),
    "absolute path": (lambda f: edit_toml(f, "a.csv", str(f / "a.csv")), ["inside the unit folder"]),
    "windows path": (lambda f: edit_toml(f, '"a.csv"', "'C:\\a.csv'"), ["inside the unit folder"]),
    "link that leaves": (outward_link, ["inside the unit folder", "link"]),
    "NUL in path": (lambda f: edit_toml(f, "a.csv", "a\\u0000.csv"), ["key file"]),
    "unknown format": (
        lambda f: (os.rename(f / "a.csv", f / "a.ods"), edit_toml(f, "a.csv", "a.ods")),
        ["a.ods", ".parquet"],
    ),
    "unknown unit": (
        lambda f: rewrite(f, header="time_s,torque_lbf,angle_arcmin"),
        ["torque unit", "torque_lbf"],
    ),
    "missing column": (lambda f: rewrite(f, header="time_s,load,angle_arcmin"), ["torque_Nm", "'load'"]),
    "unknown column key": (
        lambda f: edit_toml(f, 'file = "a.csv"', 'file = "a.csv"\ncolumns = {torqe = "torque_Nm"}'),
        ["torqe", "did you mean torque?"],
    ),
    "NaN": (lambda f: edit_row(f, 9, lambda row: cells(row, q="nan")), ["row 9", "torque_Nm", "nan"]),
    "infinity": (lambda f: edit_row(f, 9, lambda row: cells(row, a="-inf")), ["row 9", "angle_arcmin"]),
    "empty cell": (lambda f: edit_row(f, 9, lambda row: cells(row, q="")), ["row 9", "torque_Nm", "nothing"]),
    "empty row": (lambda f: edit_row(f, 9, lambda row: ""), ["row 9", "empty row"]),
    "word": (lambda f: edit_row(f, 9, lambda row: cells(row, q="n/a")), ["row 9", "n/a"]),
    "short row": (lambda f: edit_row(f, 9, lambda row: row.rsplit(",", 1)[0]), ["row 9", "angle_arcmin"]),
    "long row": (lambda f: edit_row(f, 9, lambda row: row + ",1"), ["row 9", "found 4"]),
    "one decimal comma": (
        lambda f: edit_row(f, 9, lambda row: row.replace(".", ",", 1)),
        ["row 9", "found 4", "decimal commas"],
    ),
    "time backwards": (
        lambda f: edit_row(f, 9, lambda row: cells(row, t="0.001")),
        ["row 9", "time", "0.001"],
    ),
    "time at rest": (lambda f: rewrite(f, time=np.ones_like(TIME)), ["rising time"]),
    "swapped channels": (lambda f: rewrite(f, torque=ANGLE, angle=TORQUE), ["swapped"]),
    "constant torque": (lambda f: rewrite(f, torque=0 * TORQUE + 0.5), ["constant 0.5"]),
    "constant angle": (lambda f: rewrite(f, angle=0 * ANGLE), ["angle", "constant"]),
    "one sample": (lambda f: rewrite(f, TIME[:1], TORQUE[:1], ANGLE[:1]), ["24 samples", "1 sample"]),
    "header only": (lambda f: rewrite(f, TIME[:0], TORQUE[:0], ANGLE[:0]), ["samples"]),
    "mixed decimal commas": (mixed_commas, ["row 8", "decimal mark is ','"]),
    "commas as marks and separators": (commas_twice, ["row 2", "found 6", "decimal commas"]),
    "wrong encoding": (not_text, ["UTF-8"]),
    "empty file": (lambda f: (f / "a.csv").write_bytes(b""), ["empty file"]),
    "2 GB file": (huge_file, ["at most 2 GB", "2.1 GB"]),
    "gzip bomb": (gzip_bomb, ["inflated"]),
    "xz bomb": (xz_bomb, ["inflated"]),
    "not gzip": (lambda f: compressed(f, "gz", b"time_s,torque_Nm\n"), ["intact compressed file"]),
    "not xz": (lambda f: compressed(f, "xz", b"time_s,torque_Nm\n"), ["intact compressed file"]),
    "not Parquet": (other_parquet, ["Parquet"]),
    "not TDMS": (other_tdms, ["TDMS"]),
    "not MAT": (other_mat, ["MAT"]),
    "folder for a file": (
        lambda f: ((f / "a.csv").unlink(), (f / "a.csv").mkdir()),
        ["a regular file", "a folder"],
    ),
}


def one_line(capsys):
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("backdrive-bayes: ") and captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


@pytest.mark.parametrize("case", CASES)
def test_bad_unit_is_one_line_and_nothing_is_written(case, unit_folder, tmp_path, capsys, monkeypatch):
    spoil, said = CASES[case]
    monkeypatch.chdir(tmp_path)
    spoil(unit_folder)
    before = sorted(tmp_path.rglob("*"))
    assert main(["check", str(unit_folder), "-o", str(tmp_path / "out")]) == 2
    line = one_line(capsys)
    assert all(words in line for words in said), line
    assert "expected" in line and "found" in line
    assert sorted(tmp_path.rglob("*")) == before


UNFIT = {
    "half a cycle": (lambda f: rewrite(f, TIME[:400], TORQUE[:400], ANGLE[:400]), "no_cycle"),
    "quarter to quarter": (lambda f: rewrite(f, TIME[200:600], TORQUE[200:600], ANGLE[200:600]), "no_cycle"),
    "inverted": (lambda f: rewrite(f, angle=-ANGLE), "angle_inverted"),
    "frozen": (lambda f: rewrite(f, angle=np.where(TIME > 2, ANGLE[400], ANGLE)), "frozen"),
    "slipped": (lambda f: rewrite(f, angle=ANGLE + 1000 * (TIME > 2.5)), "angle_not_answering"),
    "time reversed": (lambda f: rewrite(f, torque=TORQUE[::-1], angle=ANGLE[::-1]), "loop_reversed"),
    "few samples": (lambda f: rewrite(f, TIME[::25], TORQUE[::25], ANGLE[::25]), "few_samples"),
}


@pytest.mark.parametrize("case", UNFIT)
def test_check_ends_with_2_on_errors_and_writes_what_it_found(case, unit_folder, tmp_path, capsys):
    spoil, code = UNFIT[case]
    spoil(unit_folder)
    assert main(["check", str(unit_folder), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    found = json.loads((tmp_path / "out" / "check.json").read_text())
    row = next(row for row in found["findings"] if row["level"] == "error" and row["code"] == code)
    assert row["record"] == "a.csv" and not found["may_infer"]
    assert said.out.count(row["text"]) == said.err.count(row["text"]) == said.err.count("\n") == 1
    assert {"level": "error", "text": f"a.csv: {row['text']}"} in found["messages"]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [(["predict", "--help"], "angle with 90 % interval"), (["--help"], "angle with 90 % interval"),
     (["report", "--help"], "or the PDF file itself"), (["fit", "--help"], "folder to write into")],
)  # fmt: skip
def test_help_prints_as_it_is_meant(arguments, told, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert told in said and "%%" not in said


LIMITS = "[loop_area_J]\nmax = 1.0\n"


@pytest.mark.parametrize("verb", ["fit", "diagnose", "accept", "compare"])
def test_every_verb_refuses_unfit_data(verb, unit_folder, tmp_path, capsys):
    rewrite(unit_folder, angle=-ANGLE)
    (tmp_path / "limits.toml").write_text(LIMITS)
    more = {"accept": ["--limits", str(tmp_path / "limits.toml")], "compare": [str(unit_folder)]}.get(verb, [])
    assert main([verb, str(unit_folder), *more, "-o", str(tmp_path / "out")]) == 2
    line = one_line(capsys)
    assert "--force" in line and 'angle = "-angle_arcmin"' in line
    assert not (tmp_path / "out").exists()


FITTED = {"schema": INDICATORS, "convergence": {"converged": True}}


def test_force_goes_on_and_says_so(unit_folder, capsys):
    rewrite(unit_folder, angle=-ANGLE)
    ready = ready_unit(unit_folder, force=True)
    said = capsys.readouterr().out
    assert "forced: the data are unfit" in said and "error: a.csv: the angle falls" in said
    result = ready.stamp(FITTED | {"unit": "u"})
    assert result["forced"] is True and result["findings"][0]["code"] == "angle_inverted"
    assert (result["outcome"]["word"], result["outcome"]["caveat"]) == ("converged", FORCED)
    assert collected([result])["forced"] and collected([result])["findings"][0]["unit"] == "u"


def test_warnings_are_repeated_and_kept(unit_folder, capsys):
    edit_toml(unit_folder, "= 1.0", "= 150.0")
    ready = ready_unit(unit_folder)
    said = capsys.readouterr().out
    assert "warning: the largest torque tested" in said and "lost motion is not defined" in said
    assert not ready.stamp(dict(FITTED))["forced"]
    assert "lost motion is not defined" not in str(ready_unit(unit_folder, k=0.005).lines)


def test_what_force_cannot_mend_is_one_line(unit_folder, tmp_path, capsys, monkeypatch):
    def fail(*_, **__):
        raise ValueError("no blocks")

    rewrite(unit_folder, TIME[:400], TORQUE[:400], ANGLE[:400])
    monkeypatch.setattr("backdrive_bayes.commands.fit.fit_unit", fail)
    assert main(["fit", str(unit_folder), "--force", "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "even with --force (no blocks)" in error


@pytest.mark.parametrize("argv", [["check", "a\0b"], ["check", "x", "-o", "a\0b"], ["report", "x\0"]])
def test_a_name_with_nul_is_one_line(argv, capsys):
    assert main(argv) == 2
    assert "without NUL" in one_line(capsys)


def test_deep_json_is_one_line(tmp_path, capsys):
    (tmp_path / "indicators.json").write_text("[" * 200_000)
    (tmp_path / "posterior.nc").write_bytes(b"x")
    (tmp_path / "limits.toml").write_text(LIMITS)
    assert main(["accept", str(tmp_path), "--limits", str(tmp_path / "limits.toml")]) == 2
    assert "indicators.json: expected a JSON result file, found unreadable file (nested too deeply)" in one_line(capsys)


def test_row_bound_holds_for_every_format(unit_folder, capsys, monkeypatch):
    monkeypatch.setattr(limits, "MAX_ROWS", 100)
    assert main(["check", str(unit_folder), "-o", str(unit_folder / "out")]) == 2
    assert "at most 100 rows" in one_line(capsys)


@pytest.mark.parametrize(
    "argv, said",
    [
        ([], "VERB"),
        (["chek", "x"], "chek"),
        (["check"], "UNIT"),
        (["check", "x", "--sed", "1"], "--sed"),
        (["check", "x", "--seed", "-1"], "--seed"),
        (["check", "x", "--seed", "1.5"], "whole number"),
        (["check", "no-such-unit"], "nothing there"),
    ],
)
def test_wrong_usage_is_one_line(argv, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(argv) == 2
    assert said in one_line(capsys)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("argv", [["--help"], ["check", "--help"], ["--version"]])
def test_help_and_version_leave_with_0(argv, capsys):
    assert main(argv) == 0
    assert "backdrive-bayes" in capsys.readouterr().out


def test_a_good_unit_is_checked(unit_folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["check", str(unit_folder)]) == 0
    assert sorted(path.name for path in (tmp_path / "u-check").iterdir()) == ["check.json"]
    captured = capsys.readouterr()
    assert "inference may go on" in captured.out and captured.err == ""


def test_same_input_same_bytes(unit_folder, tmp_path):
    for out in ("one", "two"):
        assert main(["check", str(unit_folder), "-o", str(tmp_path / out), "--seed", "3"]) == 0
    assert (tmp_path / "one" / "check.json").read_bytes() == (tmp_path / "two" / "check.json").read_bytes()


def test_out_that_is_a_file_is_refused_and_kept(unit_folder, tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    for out in ("out", "out/below"):
        assert main(["check", str(unit_folder), "-o", str(tmp_path / out)]) == 2
        one_line(capsys)
    assert (tmp_path / "out").read_text() == "mine"


def test_interruption_and_full_disk(unit_folder, tmp_path, capsys, monkeypatch):
    for error, code in (
        (KeyboardInterrupt(), 130),
        (OSError(28, "No space left on device", "x"), 2),
        (MemoryError(), 2),
    ):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr("backdrive_bayes.records.check.check_unit", fail)
        assert main(["check", str(unit_folder), "-o", str(tmp_path / "out")]) == code
        one_line(capsys)
    assert not (tmp_path / "out").exists()


def test_folder_appears_whole_or_not_at_all(tmp_path):
    out = tmp_path / "a" / "b"
    with pytest.raises(RuntimeError), write_folder(out) as folder:
        (folder / "x").write_text("half")
        raise RuntimeError
    assert not list(tmp_path.iterdir())
    with write_folder(out) as folder:
        (folder / "x").write_text("1")
    (out / "foreign").write_text("kept")
    with write_folder(out) as folder:
        write_json(folder / "x", {"b": np.float64("nan"), "a": np.arange(2), "c": (np.bool_(True), tmp_path)})
    assert (
        out / "x"
    ).read_text().split() == f'{{ "b": null, "a": [ 0, 1 ], "c": [ true, "{tmp_path}" ] }}'.split()
    assert sorted(path.name for path in out.iterdir()) == ["foreign", "x"]
    assert not [path for path in out.parent.iterdir() if path != out]


@pytest.mark.parametrize("name", ["../../etc", "a/b", "", "\x1b[31m", "Ω 3", "." * 5, "x" * 400])
def test_default_out_stays_in_the_working_directory(name):
    out = default_out(name, "check")
    assert len(out.parts) == 1 and str(out).endswith("-check") and len(str(out)) < 100
    assert not str(out).startswith(".") and str(out).isprintable()


def test_names_from_files_are_shown_not_obeyed(unit_folder, tmp_path, capsys):
    edit_toml(unit_folder, '"u"', '"\\u001b[31mred"')
    assert main(["check", str(unit_folder), "-o", str(tmp_path / "out")]) == 0
    assert "\x1b" not in capsys.readouterr().out


def test_true_process(unit_folder, tmp_path):
    missing_file(unit_folder)
    command = [
        sys.executable,
        "-m",
        "backdrive_bayes",
        "check",
        str(unit_folder),
        "-o",
        str(tmp_path / "out"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stdout == "" and done.stderr.count("\n") == 1 and "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
