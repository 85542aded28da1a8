"""A company's template dresses the report, its texts print as they stand, and what is wrong with it is one clear line."""

import shutil
import struct
import zlib
from pathlib import Path

import pytest
from support.decided import diagnosis, evidence
from support.pdf import Pages
from support.told import told
from support_results import write_result

from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.output import write_json
from backdrive_bayes.commands.report import read_template
from backdrive_bayes.decisions.acceptance import assess
from backdrive_bayes.decisions.limits import Limit, Limits
from backdrive_bayes.errors import BadInput
from backdrive_bayes.report import report

pytestmark = pytest.mark.usefixtures("blank_pictures")

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "template"
HOSTILE = "#strong[x] $x$ *b* _i_ `c` @ref S_g //"
FIRST_PAGE = (
    "Example Drives Ltd Test laboratory, hall 4 12 Sample Road, Exampletown lab@example.com Report no. TR-0815 Customer "
    "Robotics & Sons Order 47110815 Test stand TS-3, torque sensor 2 N·m Calibrated 2024-03-01 Ambient [°C] "
    "u: acceptance ACCEPTED"
)
LAST_LINE = "TR-0815, issue 2. To be copied in full only."


def svg(inside='<rect width="9" height="9"/>', start='<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">'):
    return f"{start}{inside}</svg>".encode()


def png(width=30, height=10, cut=None):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = zlib.compress((b"\0" + b"\x10\x80\xc0" * min(width, 30)) * min(height, 10))
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b""))[:cut]


def template(folder, text=None, **logos):
    folder.mkdir(parents=True, exist_ok=True)
    if text is not None:
        (folder / "template.toml").write_text(text, encoding="utf-8")
    for suffix, data in logos.items():
        (folder / f"logo.{suffix}").write_bytes(data)
    return folder


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verdict")
    verdict = assess([evidence("u", diagnosis=diagnosis(none=0.99))], Limits((Limit("peak_angle_rad", hi=1.0),)))
    write_json(folder / "verdict.json", told(verdict))
    return folder


@pytest.fixture(scope="module")
def dressed(result):
    data = report.report_bytes([result], read_template(EXAMPLE))
    return data, Pages(data)


def test_the_first_page_is_the_company_s(dressed):
    first, *later = dressed[1]
    assert first.startswith(FIRST_PAGE)
    assert first.endswith(f"Tested by Released by Date Test report: u: acceptance {LAST_LINE} page 1 of 2")
    assert "Signature" not in first
    assert [t.startswith("Example Drives Ltd ") and t.endswith(f"{LAST_LINE} page 2 of 2") for t in later] == [True]
    assert dressed[1].reader.metadata.title == "Test report: u: acceptance"


def test_it_is_still_tagged_with_a_logo_that_is_told_in_words(dressed):
    root = dressed[1].reader.trailer["/Root"]
    assert root["/MarkInfo"]["/Marked"] and b"<pdfuaid:part>1</pdfuaid:part>" in root["/Metadata"].get_data()
    assert "Example Drives: a gear around a hysteresis loop" in list(alternatives(root["/StructTreeRoot"]))


def alternatives(node):
    """All alternative texts of a structure tree."""
    node = node.get_object()
    if isinstance(node, dict):
        if "/Alt" in node:
            yield str(node["/Alt"])
        children = node.get("/K", [])
        children = children if isinstance(children, list) else [children]
        for child in children:
            yield from alternatives(child)


def test_no_text_is_below_8_pt_and_all_fonts_are_embedded(dressed):
    sizes = set()

    def see(text, cm, tm, font, size):
        if text.strip():
            sizes.add(round(abs(size * tm[3] * cm[3]), 2))

    for page in dressed[1].reader.pages:
        page.extract_text(visitor_text=see)
        for font in page["/Resources"].get("/Font", {}).values():
            inner = font.get_object()["/DescendantFonts"][0].get_object() if "/DescendantFonts" in font.get_object() else font
            assert {"/FontFile", "/FontFile2", "/FontFile3"} & set(inner.get_object()["/FontDescriptor"].get_object())
    assert min(sizes) >= 8.0 and max(sizes) == 17.0


def test_headings_and_lines_take_the_colours_and_the_verdict_keeps_its_own(result):
    drawn = report.compile_report([result], read_template(EXAMPLE), format="svg")[0].decode()
    plain = report.compile_report([result], format="svg")[0].decode()
    for colour in ("#0b3c5d", "#d98e04"):
        assert colour in drawn and colour not in plain
    assert "#00593f" in drawn and "#00593f" in plain


def test_the_same_template_gives_the_same_bytes_and_an_empty_one_the_plain_text(dressed, result, tmp_path):
    assert report.report_bytes([result], read_template(EXAMPLE)) == dressed[0]
    plain = report.report_bytes([result])
    empty = report.report_bytes([result], read_template(template(tmp_path / "t", "")))
    assert list(Pages(empty)) == list(Pages(plain))
    assert "Example" not in Pages(plain).text


def test_a_png_logo_without_a_name_and_paper_of_another_size(result, tmp_path):
    folder = template(tmp_path / "t", 'paper = "us-letter"', png=png())
    reader = Pages(report.report_bytes([result], read_template(folder))).reader
    assert [float(v) for v in reader.pages[0].mediabox[2:]] == [612, 792]
    assert len(reader.pages[0].images) == 1 and "Company logo" in list(alternatives(reader.trailer["/Root"]["/StructTreeRoot"]))


def test_texts_print_as_they_stand(result, tmp_path):
    keys = ("company", "title", "footer", "logo_text")
    text = "".join(f"{k} = '{HOSTILE}'\n" for k in keys)
    text += f"address = ['{HOSTILE}']\n[fields]\n'#a $b$ *c*' = '''{HOSTILE}\n d'''"
    folder = template(tmp_path / "t", text, svg=svg())
    pages = Pages(report.report_bytes([result], read_template(folder)))
    first = pages[0]
    assert first.count(HOSTILE) == 5 and f"#a $b$ *c* {HOSTILE} d" in first
    reader = pages.reader
    assert reader.metadata.title.startswith(HOSTILE) and HOSTILE in list(alternatives(reader.trailer["/Root"]["/StructTreeRoot"]))


def test_a_full_summary_stays_one_page(tmp_path):
    write_result(tmp_path / "fit", records=6)
    (tmp_path / "fit" / "posterior.nc").unlink()
    rows = "\n".join(f'"Label number {i}" = "{"word " * 8}"' for i in range(8))
    folder = template(tmp_path / "t", f'company = "C"\naddress = ["1", "2", "3", "4"]\n[fields]\n{rows}', svg=svg())
    first = Pages(report.report_bytes([tmp_path / "fit"], read_template(folder)))[0]
    assert "Label number 7" in first and "CONVERGED" in first and "Signature" in first


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('compny = "x"', "key compny: expected one of schema, company, .* found 'compny' .did you mean company"),
        ('schema = "backdrive-bayes/unit/1"', "key schema: expected '.*/template/1', found '.*/unit/1'"),
        ("company = 3", "key company: expected text of 1 to 80 characters, found 3"),
        ('footer = " "', "key footer: expected text of 1 to 160 characters, found ' '"),
        (f'company = "{"x" * 81}"', "key company: expected text of 1 to 80 characters, found 81 characters"),
        ('address = "one line"', "key address: expected a list of 1 to 4 texts, found 'one line'"),
        ('signatures = ["a", "b", "c", "d", "e"]', "key signatures: expected a list of 1 to 4 texts, found 5"),
        ("signatures = ['a', 2]", "key signatures, no. 2: expected text of 1 to 30 characters, found 2"),
        ('paper = "a5"', "key paper: expected one of 'a4', 'us-letter', found 'a5'"),
        ("paper = [1]", r"key paper: expected one of 'a4', 'us-letter', found \[1\]"),
        ('colours = "red"', "key colours: expected a table, found 'red'"),
        ('[colours]\nheading = "#000"', "key colours.heading: .* found 'heading' .did you mean headings"),
        ('[colours]\nlines = "red"', "key colours.lines: expected a colour like #1a2b3c, found 'red'"),
        ('[colours]\nlines = "#12345"', "key colours.lines: expected a colour"),
        ("[colours]\nlines = 123456", "key colours.lines: expected a colour like #1a2b3c, found 123456"),
        ('[colours]\nheadings = "#ffd700"', "key colours.headings: .* contrast at least 4.5 to 1, found #ffd700, 1.4 to 1"),
        ("fields = 3", "key fields: expected a table of at most 8 fields label = text, found 3"),
        ("[fields]\nB = 1\nA = [1]", r"key fields.A: expected text of .*, a number or a date, found \[1\]"),
        ("[fields]\nA = true", "key fields.A: expected text of .*, a number or a date, found True"),
        (f"[fields]\nA = '{'x' * 81}'", "key fields.A: expected text of at most 80 characters, .*, found 81 characters"),
        ("[fields]\n" + "\n".join(f"a{i} = 1" for i in range(9)), "key fields: expected a table of at most 8 .*, found 9"),
        ("[fields]\n'' = 1", "key fields: expected as its name text of 1 to 28 characters, found ''"),
        ("company = ", "expected valid TOML"),
        ('company = "a"\ncompany = "b"', "expected valid TOML"),
    ],
)
def test_a_wrong_key_is_one_clear_line(tmp_path, text, told):
    with pytest.raises(BadInput, match=f"template.toml.*{told}") as caught:
        read_template(template(tmp_path / "t", text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "data", "told"),
    [
        ("logo.svg", b"<svg", "expected an SVG image, found no XML"),
        ("logo.svg", b"", "expected an SVG image, found no XML"),
        ("logo.svg", b"<html/>", "expected an SVG image, found XML of another kind, <html>"),
        ("logo.svg", svg("<text y='9'>x</text>"), "convert text to paths.*found a <text> element"),
        ("logo.svg", svg('<image href="other.png" width="9" height="9"/>'), "a logo in one file, found a link to 'other.png'"),
        ("logo.svg", svg() + b" " * 1_000_001, "at most 1 MB, found a larger one"),
        ("logo.png", b"\xff\xd8\xff", "expected a PNG image, found another kind of file"),
        ("logo.png", b"", "expected a PNG image, found an empty file"),
        ("logo.png", png(width=4001), "at most 4000 pixels a side, found 4001 x 10"),
        ("logo.jpg", b"\xff\xd8\xff", "one logo, logo.svg or logo.png, found logo.jpg"),
        ("Logo.svg", svg(), "one logo, logo.svg or logo.png, found Logo.svg"),
    ],
)
def test_a_wrong_logo_is_one_clear_line(tmp_path, name, data, told):
    folder = template(tmp_path / "t")
    (folder / name).write_bytes(data)
    with pytest.raises(BadInput, match=told):
        read_template(folder)


@pytest.mark.parametrize(
    ("suffix", "data", "told"),
    [
        ("png", png(cut=50), "logo.png: expected an image that can be drawn, found failed to decode image"),
        ("svg", svg(start='<svg xmlns="http://www.w3.org/2000/svg" width="0" height="0">'), "logo.svg: .* can be drawn"),
        ("svg", svg("<g>" * 50_000 + "</g>" * 50_000), "logo.svg: .* can be drawn"),
        ("svg", svg(""), "a logo that shows on white paper, found nothing darker"),
        ("svg", svg('<rect width="9" height="9" fill="white"/>'), "a logo that shows on white paper, found nothing darker"),
    ],
)
def test_a_logo_that_cannot_be_drawn_is_one_clear_line(result, tmp_path, suffix, data, told):
    folder = template(tmp_path / "t", **{suffix: data})
    with pytest.raises(BadInput, match=told):
        report.report_bytes([result], read_template(folder))


def test_folders_that_are_no_template(tmp_path):
    with pytest.raises(BadInput, match="expected a template folder, found no such folder"):
        read_template(tmp_path / "missing")
    with pytest.raises(BadInput, match="expected a template folder with template.toml, logo.svg, logo.png, found none of them"):
        read_template(template(tmp_path / "t"))
    with pytest.raises(BadInput, match="expected a template folder, found a file"):
        read_template(EXAMPLE / "template.toml")
    with pytest.raises(BadInput, match="expected one logo, logo.svg or logo.png, found logo.png, logo.svg"):
        read_template(template(tmp_path / "both", svg=svg(), png=png()))
    (tmp_path / "t" / "logo.svg").mkdir()
    with pytest.raises(BadInput, match="expected an image file, found a folder"):
        read_template(tmp_path / "t")


def test_the_verb_takes_a_template_and_writes_nothing_with_a_bad_one(result, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["report", str(result), "-o", str(out), "--template", str(EXAMPLE)]) == 0
    assert Pages((out / "report.pdf").read_bytes())[0].startswith("Example Drives Ltd")
    shutil.rmtree(out)
    capsys.readouterr()
    for bad in (tmp_path / "missing", template(tmp_path / "a", "x = 1"), template(tmp_path / "b", svg=svg(""))):
        assert main(["report", str(result), "-o", str(out), "--template", str(bad)]) == 2
        said = capsys.readouterr()
        assert said.err.count("\n") == 1 and "expected" in said.err and not said.out
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "b"]
