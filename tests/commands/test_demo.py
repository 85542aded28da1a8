"""The demo calls every verb with all the options that the verb's own command line has."""

import tomllib
from argparse import ArgumentParser
from pathlib import Path

import pypdf
import pytest

from backdrive_bayes.commands import accept, check, compare, demo, diagnose, fit, fleet, report

HOME = Path(__file__).resolve().parents[2]
REPORT = HOME / "reports" / "demo" / "report.pdf"
PAGES = 16
VERBS = (check, fit, diagnose, accept, compare, report, fleet)


def test_each_verb_is_called_with_all_its_options(tmp_path, monkeypatch):
    called = []
    for verb in VERBS:
        monkeypatch.setattr(verb, "run", lambda args, verb=verb: called.append((verb, args)) or 0)
    options = ArgumentParser()
    demo.add_arguments(options)
    args = options.parse_args([])
    args.out, args.seed = tmp_path, 3
    assert demo.run(args) == 0
    assert {verb for verb, _ in called} == set(VERBS)
    for verb, args in called:
        own = ArgumentParser()
        verb.add_arguments(own)
        assert {a.dest for a in own._actions} - {"help"} <= set(vars(args)) and args.seed == 3 and args.out is not None


def test_an_option_that_is_left_out_would_be_seen(monkeypatch):
    """A planted fault: a verb that asks for more than its command line has."""
    monkeypatch.setattr(check, "run", lambda args: args.simulated)
    with pytest.raises(AttributeError, match="simulated"):
        demo._call(check, ["unit"], out=None, seed=0)


def test_the_committed_report_is_short():
    assert len(pypdf.PdfReader(REPORT).pages) <= PAGES


def test_the_wheel_holds_all_the_packaged_data():
    """Files that no glob of the project file names are missing where the package is installed, and the demo with them."""
    globs = tomllib.loads((HOME / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["backdrive_bayes"]
    held = {path for glob in globs for path in (HOME / "backdrive_bayes").glob(glob)}
    files = {HOME / "backdrive_bayes" / path.relative_to(HOME) for path in (HOME / "data").rglob("*") if path.is_file()}
    assert len(files) > 20 and files <= held
    assert not files <= {path for glob in globs[:-1] for path in (HOME / "backdrive_bayes").glob(glob)}, "a glob too few is seen"
