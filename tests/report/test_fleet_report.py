"""The fleet's pages: what a reader must find on them, from a fleet made by hand."""

import numpy as np
import pytest
from support.fleet_units import row
from support.told import told

from backdrive_bayes.commands.output import write_json
from backdrive_bayes.fleet.summary import summarise

pytestmark = pytest.mark.usefixtures("blank_pictures")

for library in ("typst", "matplotlib", "pypdf"):
    pytest.importorskip(library, reason="the report is made with the extra report and read with pypdf")
UNITS, SHIFT = 30, 20


def made(shift=0.0, failures=3):
    """The object of fleet.json of units in two batches, the last third of them shifted; one unit lies far out."""
    rng, units = np.random.default_rng(0), []
    values = 1e-3 * (1 + 0.02 * rng.uniform(-1, 1, UNITS)) + 1e-3 * shift * (np.arange(UNITS) >= SHIFT)
    values[4] += 4e-4
    for i, value in enumerate(values):
        judged = {"verdict": "rejected" if i == 9 else "accepted", "conformance_probability": 0.02 if i == 9 else 0.99}
        about = {"batch": "spring" if i < SHIFT else "autumn", "serial": f"A{i}", "answer": "thermal_drift" if i == 7 else "none"}
        own = {"unit": f"unit-{i}", "status": "done", "error": None}
        units.append((f"unit-{i}", f"key-{i}", [own | row(f"n{i}", float(value), limiting="loop_area_J", **about, **judged)]))
    for i in range(failures):
        own = {"unit": f"bad-{i}", "status": "failed", "error": f"a.csv: expected a cycle, found none ({i})", "data_sha256": None}
        units.append((f"bad-{i}", f"bad-key-{i}", [own]))
    return told(summarise(units))


def text_of(result, folder):
    from support.pdf import Pages

    from backdrive_bayes.report.report import report_bytes

    folder.mkdir(exist_ok=True)
    write_json(folder / "fleet.json", result)
    pdf = report_bytes([folder])
    assert pdf == report_bytes([folder])
    pages = Pages(pdf)
    links = [a.get_object()["/A"].get("/URI") for page in pages.reader.pages for a in page.get("/Annots") or []]
    return pages.text, links


@pytest.fixture(scope="module")
def steady(tmp_path_factory):
    """The words and links of a fleet without drift."""
    return text_of(made(), tmp_path_factory.mktemp("steady"))


def test_a_shift_is_said_with_the_rate_of_false_alarms_and_where_it_begins(tmp_path):
    text, _ = text_of(made(shift=0.1), tmp_path / "f")
    assert "drift of lost motion δ, dissipated energy S, dissipation ratio u" in text
    assert "from about unit-20 on" in text and "at most 1 % get an alarm" in text and "by chance 0.001" in text


def test_a_fleet_without_drift_says_so(steady):
    text, _ = steady
    assert "30 of 33 units have a result; no drift found" in text and "from about" not in text


def test_units_to_look_at_lead_to_their_files(steady):
    text, links = steady
    assert links[:2] == ["units/key-9.json", "units/key-4.json"]
    assert "rejected, conforms with probability 0.020" in text and "sigma from the centre" in text


def test_counts_batches_and_failures_are_told(steady):
    text, _ = steady
    assert "accepted 29, rejected 1" in text and "none 29, thermal drift 1" in text
    assert "spring 20" in text and "autumn 10" in text and "Kruskal" in text
    assert "bad-2" in text and "expected a cycle, found none (2)" in text and "3 failed" in text


def test_many_failures_are_cut_and_few_units_are_said(tmp_path):
    text, _ = text_of(made(failures=20), tmp_path / "f")
    assert "And 5 more in fleet.json" in text and "bad-14" in text and "bad-15" not in text
    few = [(f"u{i}", f"k{i}", [{"unit": f"u{i}", "status": "done", "error": None} | row("u", 1.0 + i)]) for i in range(3)]
    text, _ = text_of(told(summarise(few)), tmp_path / "g")
    assert "too few units to find drift" in text and "Units to look at" not in text
