"""Progress: a bar on a terminal, plain lines elsewhere, and nothing before the work begins."""

import io
import re
import time
from types import SimpleNamespace

import pytest

from backdrive_bayes.commands import progress as module
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.progress import CELLS, line, progress


class Terminal(io.StringIO):
    encoding = "ascii"

    def isatty(self):
        return True


@pytest.fixture
def terminal(monkeypatch):
    stream = Terminal()
    # Not sys.stderr itself, which pytest sets anew before the test.
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream))
    monkeypatch.setattr(module, "REDRAW_SECONDS", 0.01)
    return stream


def bars(text):
    return [found.count("#") for found in re.findall(r"\[([#-]+)\]", text)]


@pytest.mark.parametrize(("passed", "budget", "share", "full"), [
    (0, 40, None, 0), (10, 40, None, CELLS // 4), (90, 40, None, CELLS), (1, None, 0.5, CELLS // 2), (39, 40, 0.25, CELLS // 4),
])  # fmt: skip
def test_the_bar_is_as_full_as_the_work(passed, budget, share, full):
    assert bars(line(passed, budget, "at work", share)) == [full]


def test_the_line_says_time_budget_and_what_is_being_done():
    assert line(12.3, 120.0, "warming up").endswith("] 12 of 120 s  warming up")
    assert line(12.3, None, "warming up").endswith("] 12 s  warming up")


def test_without_a_budget_a_block_runs_to_and_fro():
    at = [line(0.5 * i, None, "").index("#") for i in range(2 * CELLS)]
    assert at[:CELLS] == list(range(1, CELLS + 1)) and at[CELLS] == at[CELLS - 2] and bars(line(3.0, None, "")) == [1]


def test_a_terminal_shows_a_bar_that_moves_between_notes_and_leaves_nothing(terminal):
    with progress(0.1) as note:
        note("N\u00b7m \x1b[31m")
        time.sleep(0.3)
    drawn = terminal.getvalue()
    assert bars(drawn)[0] < bars(drawn)[-1] == CELLS, "one note, several states"
    assert drawn.endswith("\r\x1b[K") and "\n" not in drawn
    assert "N\\xb7m \\x1b[31m" in drawn, "what the terminal cannot show, or would obey, is spelt out"


def test_a_share_that_is_known_beats_the_clock(terminal):
    with progress(1e6) as note:
        note("3 of 4", 0.75)
        time.sleep(0.05)
    assert bars(terminal.getvalue())[-1] == 0.75 * CELLS


def test_the_bar_fits_the_terminal(terminal, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    with progress() as note:
        note("x" * 500)
        time.sleep(0.05)
    assert "xxx" in terminal.getvalue()
    assert all(len(part) < 40 for part in terminal.getvalue().split("\r\x1b[K"))


def test_without_a_note_a_terminal_sees_nothing(terminal):
    with pytest.raises(RuntimeError), progress(10.0):
        raise RuntimeError
    assert terminal.getvalue() == ""


def test_elsewhere_there_are_plain_lines_and_few(capsys, monkeypatch):
    clock = iter([0.0, 0.0, 3.0, 6.0])
    monkeypatch.setattr(module.time, "monotonic", lambda: next(clock))
    with progress(100.0) as note:
        for text in ("one", "two", "three"):
            note(text, 0.5)
    assert capsys.readouterr().err == "0 s  one\n6 s  three\n"


BAD = {
    "--baseline": ["--baseline", "foo"],
    "no elasticity": ["--baseline", "geometric,friction"],
    "--k": ["--k", "2"],
    "--level": ["--level", "nan"],
    "out is a file": ["-o", "unit/a.csv"],
}


def refused(argv, capsys):
    """Exit code 2 and one line on standard error, which no progress line precedes."""
    assert main(argv) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("backdrive-bayes: ") and captured.err.count("\n") == 1, captured.err
    assert "expected" in captured.err and "found" in captured.err


@pytest.mark.parametrize("verb", ["fit", "diagnose", "accept", "compare"])
@pytest.mark.parametrize("case", BAD)
def test_bad_options_are_refused_before_the_first_progress_line(verb, case, unit_folder, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "limits.toml").write_text("[loop_area_J]\nmax = 1")
    more = {"accept": ["--limits", "limits.toml"], "compare": [str(unit_folder)]}.get(verb, [])
    before = sorted(tmp_path.rglob("*"))
    refused([verb, str(unit_folder), *more, *BAD[case]], capsys)
    assert sorted(tmp_path.rglob("*")) == before
