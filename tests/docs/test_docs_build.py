"""The documentation builds without a warning, fetches nothing from elsewhere, and has every drawing that it shows."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
for library in ("sphinx", "numpydoc", "myst_parser", "furo", "latex2mathml", "ziamath"):
    pytest.importorskip(library, reason="the extra docs is not installed")
FETCHED = re.compile(r'(?:src=|<link[^>]* href=|@import |url\()["\']?(?:https?:)?//[^"\')\s>]+')
LONGEST_S = 30


def build(folder, out):
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(folder), str(out)]
    return subprocess.run(command, capture_output=True, text=True, timeout=3 * LONGEST_S)


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """The pages and what they are made of, in a place where the build may write."""
    room = tmp_path_factory.mktemp("docs")
    ignored = shutil.ignore_patterns("_generated", "__pycache__", "*.pdf")
    for name in ("docs", "reports", "examples"):
        shutil.copytree(ROOT / name, room / name, ignore=ignored)
    return room


@pytest.fixture(scope="module")
def built(copied):
    done = build(copied / "docs", copied / "html")
    assert done.returncode == 0 and not done.stderr, done.stderr
    return copied / "html"


def test_every_page_is_built(built):
    pages = {p.stem for p in (ROOT / "docs").glob("*.md")}
    assert pages and pages <= {p.stem for p in built.glob("*.html")}
    reports = {p.parent.name for p in (ROOT / "reports").glob("*/README.md")}
    assert reports == {p.stem for p in (built / "_generated" / "reports").glob("*.html")}


def test_nothing_is_fetched_from_elsewhere(built):
    files = [*built.rglob("*.html"), *built.rglob("*.css")]
    assert len(files) > 20
    assert not [f"{p.name}: {m[0]}" for p in files for m in FETCHED.finditer(p.read_text(encoding="utf-8"))]
    assert FETCHED.search('<script src="https://example.org/a.js">') and FETCHED.search("@import 'https://example.org/a.css'")


def test_equations_are_mathml(built):
    method = (built / "method.html").read_text(encoding="utf-8")
    written = (ROOT / "docs" / "method.md").read_text(encoding="utf-8").count("$$") // 2
    assert method.count('display="block"') == written > 10 and "$$" not in method and "\\frac" not in method
    assert list((built / "_static").glob("STIXTwoMath*"))


def test_tables_are_read_from_the_package(built):
    from backdrive_bayes.commands.main import VERBS
    from backdrive_bayes.indicators.draws import UNITS
    from backdrive_bayes.mechanics.registry import LIBRARY

    pages = {name: (built / f"{name}.html").read_text(encoding="utf-8") for name in ("verbs", "indicators", "diagnosis", "files")}
    assert all(f"usage: backdrive-bayes {verb}" in pages["verbs"] for verb in VERBS)
    assert all(name in pages["indicators"] for name in UNITS) and all(name in pages["diagnosis"] for name in LIBRARY)
    assert "rated_torque_Nm" in pages["files"] and "a positive number" in pages["files"]


def test_a_warning_is_an_error(built, copied):
    page = copied / "docs" / "planted.md"
    page.write_text("---\norphan: true\n---\n# Planted\n\n[nowhere](nowhere.md)\n", encoding="utf-8")
    done = build(copied / "docs", built)
    assert done.returncode != 0 and "nowhere" in done.stderr


def test_the_script_draws_every_drawing_and_every_drawing_is_shown(tmp_path):
    pytest.importorskip("matplotlib", reason="drawings are made with the extra figures")
    subprocess.run([sys.executable, str(ROOT / "docs" / "draw"), str(tmp_path)], check=True, timeout=60)
    drawn, kept = ({p.name for p in folder.glob("*.svg")} for folder in (tmp_path, ROOT / "docs" / "drawings"))
    shown = {n for p in (ROOT / "docs").glob("*.md") for n in re.findall(r"\(drawings/([^)]+)\)", p.read_text(encoding="utf-8"))}
    assert drawn == kept == shown and len(drawn) >= 10
