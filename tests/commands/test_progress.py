"""Progress: a bar on a terminal, plain lines elsewhere, and nothing before the work begins."""

import io
import re
import time
from types import SimpleNamespace

import pytest

from backdrive_bayes.commands import progress as module
from backdrive_bayes.commands.main import main
from backdrive_bayes.commands.progress import CELLS, bar, plain, progress, span
from backdrive_bayes.commands.stages import ACCEPT, DIAGNOSE, FIT_KEPT, MOST_OF_A_STAGE, Clock, Stage

WORK = (Stage("warming up", 2.0), Stage("work", 6.0), Stage("clearing", 2.0))


class Terminal(io.StringIO):
    encoding = "ascii"

    def isatty(self):
        return True


@pytest.fixture
def terminal(monkeypatch):
    stream = Terminal()
    # Not sys.stderr itself, which pytest sets anew before the test.
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream))
    monkeypatch.setattr(module, "TICK_SECONDS", 0.01)
    return stream


def bars(text):
    return [found.count("#") for found in re.findall(r"\[([#-]+)\]", text)]


class Hands:
    """A clock that is set by hand."""

    at = 0.0

    def __call__(self):
        return self.at


def clock(*steps, stages=WORK):
    """The clock of a run that noted texts at times, ended by a time."""
    hands = Hands()
    made = Clock(stages, hands)
    *notes, end = steps
    for at, *note in notes:
        hands.at = at
        made.note(*note)
    hands.at = end
    return made


def test_the_share_follows_from_typical_times_at_the_speed_so_far():
    steps = (0.0, "warming up"), (4.0, "the work begins"), 10.0  # half the typical speed
    assert clock(*steps).share == pytest.approx((2 + 3) / 10)
    assert clock(*steps).left_s == pytest.approx(10.0)
    assert bars(bar(clock(*steps))) == [CELLS // 2]
    assert plain(clock(*steps)) == "10 s, 50%, about 10 s left: the work begins"


def test_a_stage_that_lasts_waits_and_a_run_never_goes_back():
    assert clock((0.0, "warming up"), (2.0, "work"), 1e4).share == pytest.approx((2 + MOST_OF_A_STAGE * 6) / 10)
    assert clock((0.0, "warming up"), (2.0, "clearing"), (2.0, "warming up again"), 2.0).share == pytest.approx(0.8)


def test_nothing_is_told_that_is_not_known():
    assert clock((0.0, "something"), 5.0).share is None and clock((0.0, "warming up"), 0.5).left_s is None
    assert plain(clock((0.0, "something"), 5.0)) == "5 s: something"


@pytest.mark.parametrize("stages", [FIT_KEPT, DIAGNOSE, ACCEPT])
def test_a_run_through_all_stages_only_rises_to_its_end(stages):
    hands = Hands()
    made, shares = Clock(stages, hands), []
    for stage in stages:
        made.note(f"unit: {stage.said} now")
        for _ in range(4):
            shares.append(made.share)
            hands.at += stage.typical_s
    assert shares == sorted(shares) and shares[0] == 0.0 and 0.9 < made.share <= 1.0


@pytest.mark.parametrize(("seconds", "said"), [(0.4, "0 s"), (59.6, "1 min 00 s"), (200, "3 min 20 s"), (7500, "2 h 05 min")])
def test_spans_read_as_said(seconds, said):
    assert span(seconds) == said


def test_without_stages_a_block_runs_to_and_fro():
    at = [bar(clock((0.0, ""), 0.5 * i, stages=())).index("#") for i in range(2 * CELLS)]
    assert at[:CELLS] == list(range(1, CELLS + 1)) and at[CELLS] == at[CELLS - 2]


def test_a_terminal_shows_a_bar_that_moves_between_notes_and_leaves_nothing(terminal):
    with progress(Stage("N\u00b7m", 0.2)) as note:
        note("N\u00b7m \x1b[31m")
        time.sleep(0.4)
    drawn = terminal.getvalue()
    assert bars(drawn)[0] < bars(drawn)[-1] == int(MOST_OF_A_STAGE * CELLS), "one note, several states"
    assert drawn.endswith("\r\x1b[K") and "\n" not in drawn
    assert "N\\xb7m \\x1b[31m" in drawn, "what the terminal cannot show, or would obey, is spelt out"


def test_a_share_that_is_known_beats_the_clock(terminal):
    with progress(Stage("of", 1e6)) as note:
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
    with pytest.raises(RuntimeError), progress(*WORK):
        raise RuntimeError
    assert terminal.getvalue() == ""


def test_elsewhere_there_are_plain_lines_few_but_never_long_apart(capsys, monkeypatch):
    monkeypatch.setattr(module, "TICK_SECONDS", 0.01)
    monkeypatch.setattr(module, "PLAIN_SECONDS", 0.2)
    monkeypatch.setattr(module, "PLAIN_FEWEST", 0.1)
    with progress(*WORK) as note:
        note("warming up")
        time.sleep(0.5)
        for i in range(1000):
            note(f"work {i}")
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= sum("warming up" in line for line in lines) <= 4, "a long stage is told again, seldom"
    assert len(lines) <= 6 and "\r" not in "".join(lines)


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
