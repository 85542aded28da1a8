"""Targets of the Makefile: described, documented, and made of scripts and verbs that exist."""

import re
import tomllib
from pathlib import Path

import pytest

from backdrive_bayes.commands.main import VERBS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "Makefile").read_text(encoding="utf-8")


def undescribed(text):
    """Targets that the head of the file does not explain."""
    targets = set(re.search(r"^\.PHONY: (.*)", text, re.MULTILINE)[1].split()) - {"clean"}
    return targets ^ set(re.findall(r"^# make (\w+):", text, re.MULTILINE))


def missing(text):
    """Scripts and verbs in recipes that do not exist."""
    scripts = [s for s in re.findall(r"\b(?:studies|docs|tests)/[\w/]+\.py", text) if not (ROOT / s).is_file()]
    return scripts + [v for v in re.findall(r"/backdrive-bayes (\w+)", text) if v not in VERBS]


def test_every_target_is_described_and_made_of_what_exists():
    assert not undescribed(TEXT) and not missing(TEXT)


@pytest.mark.parametrize("target", ["demo", "test", "lint", "versions", "docs"])
def test_every_target_is_documented(target):
    assert f"`make {target}`" in (ROOT / "docs" / "shown.md").read_text(encoding="utf-8")


def test_what_is_forbidden_is_seen():
    assert undescribed(TEXT.replace("# make lint:", "# lint:")) == {"lint"}
    assert missing(TEXT.replace("studies/versions.py", "studies/other.py")) == ["studies/other.py"]
    assert missing(TEXT.replace("backdrive-bayes demo", "backdrive-bayes show")) == ["show"]


def test_types_are_checked_in_the_whole_package_and_in_the_studies():
    checks = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]
    everywhere = {"files": ["backdrive_bayes", "studies"], "mypy_path": "studies", "explicit_package_bases": True}
    assert checks == everywhere | {"ignore_missing_imports": True}
