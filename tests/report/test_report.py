"""The PDF holds the numbers of the JSON, prints free text as it stands and is the same bytes again."""

import json
import os
import re

import pytest
from support.pdf import Pages
from support_results import GROUP_ATTRIBUTES, indicators, write_result

from backdrive_bayes.errors import BadInput, MissingExtra
from backdrive_bayes.figures.style import loop_words, record_labels, shown_unit
from backdrive_bayes.number_text import interval_text, significant, with_error
from backdrive_bayes.report import fit_section, report
from backdrive_bayes.report.blocks import Note, Picture, Table
from backdrive_bayes.report.findings import warned
from backdrive_bayes.report.overview import overview_blocks
from backdrive_bayes.report.text import cut, free, printable, typeset

pytestmark = pytest.mark.usefixtures("blank_pictures")

HOSTILE = "#strong[x] $x$ \\u{1F600} <script> *b* _i_ `c` @ref //"
ARCMIN = 10800 / 3.141592653589793


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """The object behind a report, its bytes, its pages and its folder."""
    folder = tmp_path_factory.mktemp("fit")
    identity = {"material": "steel #eval(1)", "credit": "A. Author 2024", "license": "CC BY 4.0"}
    result = write_result(folder, records=2, unit=HOSTILE, identity=identity)
    data = report.report_bytes([folder])
    return result, data, Pages(data), folder


def test_the_first_page_has_the_indicators_of_the_json(made):
    result, _, pages, _ = made
    page = pages[0]
    factors = {"rad": ARCMIN, "J": 1e3, "ratio": 1.0}
    for record in result["records"]:
        for name, entry in record["indicators"].items():
            factor = factors[name.rsplit("_", 1)[1]]
            median, lo, hi = (float(v) for v in re.findall(r"[\d.]+", interval_text(entry, factor)))
            assert median == pytest.approx(
                factor * entry["median"], abs=0.35 * factor * (entry["hi"] - entry["lo"])
            )
            assert interval_text(entry, factor) in page
            assert lo <= median <= hi
    assert "model error" not in page and "k = 0.03" in page and "90 %" in page
    digest = GROUP_ATTRIBUTES["data_sha256"]
    assert f"{digest[:12]}…" in page and digest not in page and digest in pages.text
    assert "CONVERGED" in page and "INCONCLUSIVE" not in page
    assert "A. Author 2024" in page and "CC BY 4.0" in page


def test_free_text_prints_as_it_stands(made):
    pages = made[2]
    assert HOSTILE in pages[0]
    assert "steel #eval(1)" in pages[0]
    assert HOSTILE in pages.reader.metadata.title
    assert HOSTILE in [item.title for item in pages.reader.outline if not isinstance(item, list)]


def test_metadata_tags_and_fonts(made):
    reader = made[2].reader
    root = reader.trailer["/Root"]
    assert (
        root["/MarkInfo"]["/Marked"]
        and root["/Lang"] == "en"
        and reader.metadata.author.startswith("backdrive-bayes")
    )
    assert b"<pdfuaid:part>1</pdfuaid:part>" in root["/Metadata"].get_data()
    assert "/CreationDate" not in reader.metadata
    for page in reader.pages:
        for font in page["/Resources"].get("/Font", {}).values():
            descendant = (
                font.get_object()["/DescendantFonts"][0]
                if "/DescendantFonts" in font.get_object()
                else font.get_object()
            )
            descriptor = descendant.get_object()["/FontDescriptor"].get_object()
            assert {"/FontFile", "/FontFile2", "/FontFile3"} & set(descriptor)


def test_details_name_seed_versions_priors_and_reconstructed_equations(made):
    text = made[2].text
    for needed in (
        "Seed 7",
        "numpy 2.0",
        "Implied prior",
        "eq. (20), reconstructed",
        "10.1177/00202940261442382",
    ):
        assert needed in text


def test_intervals_come_with_their_level(made):
    text = made[2].text
    assert "median and 90 % interval" in text and "median and interval" not in text
    for beneath in ("S", "τ₁: half the rise"):
        assert f"Median [90 % interval]. {beneath}" in text


def test_parameters_stand_beside_the_implied_prior_with_their_meaning(made):
    about = made[0]["parameters"]["drag_torque_Nm"]
    text = made[2].text
    assert f"drag torque {interval_text(about, 1e3)} mN·m {interval_text(about['prior_interval'], 1e3)}" in text
    assert "drag torque: what drag_torque_Nm means" in text and "Implied prior, 90 %" in text


def test_loads_are_shown_where_they_are_saved(tmp_path):
    result = write_result(tmp_path, records=1)
    (tmp_path / "posterior.nc").unlink()
    assert "Loads that were asked for" not in pages_of(tmp_path).text
    angle, energy = ({"median": m, "lo": 0.9 * m, "hi": 1.1 * m} for m in (0.0728, 1.562e-3))
    load = {"load_Nm": 0.05, "loading_rate_Nm_per_s": 0.02, "theta_L_rad": angle, "W_L_J": energy, "predicted": []}
    result["loads"] = [load, load | {"load_Nm": 0.2, "predicted": ["load", "loading_rate"]}]
    (tmp_path / "indicators.json").write_text(json.dumps(result))
    text = pages_of(tmp_path).text
    shown = f"{interval_text(angle, ARCMIN)} {interval_text(energy, 1e3)}"
    assert f"0.0500 0.0200 {shown} no" in text and f"0.200 0.0200 {shown} load and rate" in text


def pages_of(*folders):
    return Pages(report.report_bytes(list(folders)))


def test_not_converged_is_inconclusive_with_advice(tmp_path):
    bad = indicators(1)["convergence"] | {"converged": False, "advice": "give it more time", "max_rhat": None}
    write_result(tmp_path, records=1, convergence=bad)
    (tmp_path / "posterior.nc").unlink()
    page = Pages(report.write_report([tmp_path], tmp_path / "out" / "r.pdf").read_bytes())[0]
    assert "INCONCLUSIVE" in page and "give it more time" in page and "Do not use" in page
    assert "provisional – not to be used" in page and "Signature" not in page


@pytest.mark.parametrize("converged", [True, False])
def test_traces_are_shown_until_the_chain_has_converged(tmp_path, converged):
    write_result(tmp_path, records=1, convergence=indicators(1)["convergence"] | {"converged": converged, "advice": "more"})
    shown = [block.name for block in fit_section.chapter(tmp_path).details if isinstance(block, Picture)]
    assert "corner" in shown and ("trace" in shown) != converged


def test_what_the_check_found_and_was_overruled_stands_on_the_first_page(tmp_path):
    finding = {"level": "warning", "code": "x", "text": "the rated torque is 1000 times what was tested", "record": "a.csv"}
    note = finding | {"level": "note", "text": "closes well"}
    write_result(tmp_path, records=1, findings=[finding, note], forced=True)
    (tmp_path / "posterior.nc").unlink()
    page = pages_of(tmp_path)[0]
    assert "FORCED: unfit data" in page and "warning, a.csv: the rated torque is 1000 times" in page and "closes well" not in page
    assert "Do not use these intervals: Forced" in page or "Do not use these intervals: forced" in page
    assert "PROVISIONAL" in page.upper() and "Signature" not in page


def test_errors_and_warnings_of_the_check_are_counted_apart():
    levels = ["error", "warning", "warning", "note"]
    told = [warned({"findings": [{"level": level} for level in levels[:n]]}) for n in range(5)]
    assert told[:3] == ["", "1 error of the check", "1 error and 1 warning of the check"]
    assert told[3] == told[4] == "1 error and 2 warnings of the check"


def test_provisional_numbers_are_marked_beside_good_ones(tmp_path):
    bad = indicators(1)["convergence"] | {"converged": False, "advice": "give it more time"}
    good, unconverged, forced = (tmp_path / name for name in ("good", "unconverged", "forced"))
    entry = write_result(good, records=1, unit="good")["records"][0]["indicators"]["zero_torque_width_rad"]
    write_result(unconverged, records=1, unit="unconverged", convergence=bad, data_sha256=["1" * 64])
    write_result(forced, records=1, unit="forced", forced=True, data_sha256=["2" * 64])
    abouts = [fit_section.chapter(folder).about for folder in (good, unconverged, forced)]
    blocks = overview_blocks([fit_section.chapter(folder) for folder in (good, unconverged, forced)], "Report")
    plain, marked = (interval_text(entry, ARCMIN).replace(" [", f"{mark} [") for mark in ("", "?"))
    table = next(b for b in blocks if isinstance(b, Table) and b.columns[0] == "Indicator")
    assert [plain, marked, marked] in [row[2:] for row in table.rows]
    assert table.columns[2:] == ["good", "unconverged", "forced, FORCED"] and [a.forced for a in abouts] == [False, False, True]
    assert any(isinstance(b, Note) and "? marks provisional numbers" in b.text for b in blocks)
    (unconverged / "posterior.nc").unlink()
    page = pages_of(unconverged)[0]
    assert marked in page and "? marks provisional numbers" in page


def test_the_summary_stays_on_one_page_whatever_the_unit_says(tmp_path):
    identity = {f"key {i}": "word " * 30 for i in range(6)} | {
        "control": "a\x00b\x1b[31m\u202ec\ue000d",
        "cjk": "減速機",
    }
    write_result(tmp_path, records=3, unit="A" * 300, identity=identity)
    pages = pages_of(tmp_path)
    assert "Signature" in pages[0] and "Module decomposition" in pages[1]
    assert r"a\u{0}b\u{1B}[31m\u{202E}c\u{E000}d" in pages[0].replace("\u200b", "")


def test_least_squares_stand_beside_the_posterior(tmp_path):
    records = indicators(1)["records"]
    branch = {"r_squared": 0.9991, "rms_rad": 3e-4, "rms_high_load_over_rest": None}
    records[0]["least_squares"] = {"branches": {"ascending": branch}, "indicators": {"loop_area_J": 3.02e-4}}
    records[0]["indicators"]["lost_motion_rad"] = None
    write_result(tmp_path, records=1)
    result = json.loads((tmp_path / "indicators.json").read_text()) | {"records": records}
    (tmp_path / "indicators.json").write_text(json.dumps(result))
    (tmp_path / "posterior.nc").unlink()
    text = pages_of(tmp_path).text
    assert "0.3020 0.3630" in text and "0.9991" in text and "not defined" in text


def test_several_folders_make_one_report_with_a_summary_each(tmp_path):
    for name in ("a", "b"):
        write_result(tmp_path / name, records=1, unit=f"unit {name}")
        (tmp_path / name / "posterior.nc").unlink()
    pages = pages_of(tmp_path / "a", tmp_path / "b")
    assert "unit a" in pages[0] and "unit b" in pages[0]
    assert "unit a" in pages[1] and "unit b" in pages[2]
    assert pages.reader.metadata.title == "Backdrivability report: unit a, unit b"


def test_a_long_title_ends_with_a_whole_word(tmp_path):
    names = [f"gearbox {greek} northern" for greek in ("alpha", "beta", "gamma")]
    for name in names:
        write_result(tmp_path / name, records=1, unit=name)
        (tmp_path / name / "posterior.nc").unlink()
    footer = pages_of(*(tmp_path / n for n in names))[0]
    whole = f"Backdrivability report: {', '.join(names)}"
    assert f"{whole[:88].rsplit(' ', 1)[0]}… page 1 of" in footer
    assert cut("one two three", 9) == "one two…" and cut("one two, three", 9) == "one two…" and cut("x" * 20, 9) == "x" * 8 + "…"
    assert cut("one two", 7) == "one two" and free("a" * 5 + " " + "b" * 30, 20) == "aaaaa " + "b" * 13 + "…"


def test_folders_without_results_and_broken_results_are_one_clear_line(tmp_path):
    with pytest.raises(BadInput, match="none of them"):
        report.report_bytes([tmp_path])
    with pytest.raises(BadInput, match="no such folder"):
        report.report_bytes([tmp_path / "missing"])
    write_result(tmp_path, records=1)
    broken = json.loads((tmp_path / "indicators.json").read_text())
    del broken["records"][0]["torque_energy"]
    (tmp_path / "indicators.json").write_text(json.dumps(broken))
    with pytest.raises(BadInput, match="indicators.json, records 1, key torque_energy: expected"):
        report.write_report([tmp_path], tmp_path / "r.pdf")
    assert not list(tmp_path.glob("*.pdf"))


def test_without_typst_the_message_names_the_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "typst", None)
    with pytest.raises(MissingExtra, match=r"backdrive-bayes\[report\]"):
        report.report_bytes([tmp_path])


def test_the_verb_writes_into_the_first_folder_or_into_out(tmp_path, capsys):
    from argparse import Namespace

    from backdrive_bayes.commands.report import run

    write_result(tmp_path / "a", records=1)
    (tmp_path / "a" / "posterior.nc").unlink()
    assert run(Namespace(results=[tmp_path / "a"], out=None)) == 0
    assert (tmp_path / "a" / "report.pdf").exists() and (tmp_path / "a" / "indicators.json").exists()
    assert run(Namespace(results=[tmp_path / "a"], out=tmp_path / "b")) == 0
    assert (tmp_path / "b" / "report.pdf").read_bytes() == (tmp_path / "a" / "report.pdf").read_bytes()
    assert run(Namespace(results=[tmp_path / "a"], out=tmp_path / "my.pdf")) == 0
    assert (tmp_path / "my.pdf").read_bytes() == (tmp_path / "a" / "report.pdf").read_bytes()
    assert "report.pdf" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("median", "lo", "hi", "shown"),
    [
        (32.68, 32.38, 32.98, "32.7 [32.4, 33.0]"),
        (0.5, -0.25, 1.2, "0.5 [−0.2, 1.2]"),
        (1234.5, 1200.0, 1270.0, "1234 [1200, 1270]"),
        (0.0015, 0.0015, 0.0015, "0.00150 [0.00150, 0.00150]"),
        (0.0, 0.0, 0.0, "0.000 [0.000, 0.000]"),
        (1e-20, 1e-21, 3e-20, "0.000 [0.000, 0.000]"),
    ],
)
def test_value_and_interval_share_sensible_decimals(median, lo, hi, shown):
    assert interval_text({"median": median, "lo": lo, "hi": hi}) == shown


def test_numbers_in_words():
    assert interval_text(None) == "not defined" and significant(None) == "not defined"
    assert with_error(8.721, 83.2, "′") == "9′ ± 83′" and with_error(-0.337, 0.021) == "−0.337 ± 0.021"
    assert with_error(61.93, 1040.0) == "62 ± 1040" and with_error(1e250, 1e3) == "1.00e+250 ± 1000"
    assert with_error(2e-9, 0.0) == "2.00e−09 ± 0"
    assert significant(0.0999977) == "0.100" and significant(1.2e-9, 2) == "1.2e−09"
    assert typeset("W_abs of S_g") == "W\ue000abs\ue001 of S\ue000g\ue001"
    assert typeset("R1.S_g_over_S; sensitivity('W_L_J')") == "R1.S_g_over_S; sensitivity('W_L_J')"
    assert printable("largest(R2.loop_area_J(amplitude=0.04))").split("\u200b")[:3] == ["largest(", "R2.", "loop_area_J("]
    assert "0.04" in printable("largest(R2.loop_area_J(amplitude=0.04))")
    broken = printable("RV-110E-127_SN20261128-0047")
    assert max(map(len, broken.split("\u200b"))) <= 12 and broken.replace("\u200b", "") == "RV-110E-127_SN20261128-0047"
    assert printable("f" * 64) == "f" * 64 and "\u200b" in printable("x" * 64)


@pytest.mark.parametrize("rows", range(7))
def test_the_main_figure_stands_once_however_long_the_facts_are(rows, tmp_path):
    """Measured among the smaller tables of the details, the fault that was there, the summary had room for a picture that it did
    not bear, which was then printed nowhere."""
    identity = {f"fact {i}": "x" for i in range(rows)}
    write_result(tmp_path, records=4, identity=identity)
    text = Pages(report.report_bytes([tmp_path])).text
    assert text.count("Measured angle against torque") == 1


def test_settings_are_told_without_powers_of_ten():
    at = {"loading_rate_Nm_per_s": 104.0, "amplitude_Nm": 1040.0}
    assert loop_words(at) == "104 N·m/s, ±1040 N·m" and loop_words(dict.fromkeys(at, 0.05)) == "0.05 N·m/s, ±0.05 N·m"
    # Rates of two records that differ by chance are told apart by their amplitudes.
    two = [{"loading_rate_Nm_per_s": rate, "amplitude_Nm": amplitude} for rate, amplitude in ((0.05, 0.1), (0.0501, 0.04))]
    assert record_labels(two) == ["0.05 N·m/s, ±0.1 N·m", "0.05 N·m/s, ±0.04 N·m"]
    assert shown_unit("N·m", [0.0, 0.0, 67.01]) == (1.0, "N·m") and shown_unit("N·m", [0.01, 0.0, 0.02]) == (1e3, "mN·m")


def test_each_fit_has_a_column_with_its_k_and_level(tmp_path):
    """Two fits of the same data: the second had taken the place of the first."""
    for name, k in (("a", 0.03), ("b", 0.2), ("c", 0.03), ("d", 0.03)):
        write_result(tmp_path / name, records=1, unit="same" if name < "c" else name, k=k)
    blocks = overview_blocks([fit_section.chapter(tmp_path / name) for name in "abcd"], "Report")
    table = next(b for b in blocks if isinstance(b, Table) and b.columns[0] == "Indicator")
    assert table.columns[2:] == ["same", "same", "c"]
    note = next(b.text for b in blocks if isinstance(b, Note) and "settled loop" in b.text)
    assert "k 0.03, 90 % intervals" in note and "k 0.2, 90 % intervals" in note and "Of 1 further fit see" in note


def test_a_copied_folder_gives_the_same_report(tmp_path):
    """Nothing depends on when a file was written: "Results of" was the day of the copy."""
    for name, day in (("a", 1e9), ("b", 1.7e9)):
        write_result(tmp_path / name / "r", records=1)
        for path in (tmp_path / name / "r").iterdir():
            os.utime(path, (day, day))
    both = [[tmp_path / name / "r", tmp_path / name / "r"] for name in "ab"]
    assert report.report_bytes(both[0]) == report.report_bytes(both[1])
