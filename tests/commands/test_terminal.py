"""Ctrl-C typed on a terminal: one line, exit code 130, no traceback."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("pty", reason="no pseudo-terminals here")

DATA = Path(__file__).resolve().parents[2] / "backdrive_bayes" / "data"
ON_TERMINAL = "import os, pty, sys; sys.exit(os.waitstatus_to_exitcode(pty.spawn(sys.argv[1:])))"
CTRL_C = b"\x03"
VERB = [sys.executable, "-m", "backdrive_bayes"]


def typed_at(command, shown, folder):
    """Run ``command`` on a terminal of its own, type Ctrl-C once ``shown`` stands there; exit code and what came after it."""
    process = subprocess.Popen(
        [sys.executable, "-c", ON_TERMINAL, *map(str, command)],
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env=os.environ | {"TERM": "xterm"},
    )
    text = b""
    while shown not in text and (more := os.read(process.stdout.fileno(), 4096)):
        text += more
    rest = process.communicate(CTRL_C, timeout=60)[0]
    return process.returncode, rest.decode()


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [
        (["fit", DATA / "reducer-1"], b"reducing the records"),
        (["diagnose", DATA / "reducer-1"], b"finding the mode"),
        (["demo"], b"reducing the records"),
    ],
    ids=["fit", "diagnose", "demo"],
)
def test_ctrl_c_is_one_line_and_no_traceback(arguments, shown, tmp_path):
    code, text = typed_at([*VERB, *arguments, "-o", tmp_path / "out"], shown, tmp_path)
    assert code == 130 and "Traceback" not in text
    assert re.findall(r"backdrive-bayes: .*", text.replace("\r", "\n")) == ["backdrive-bayes: interrupted"]
    assert text.endswith("\r\n") and not list(tmp_path.rglob("*.part*"))


def test_a_program_that_does_not_care_is_seen(tmp_path):
    code, text = typed_at([sys.executable, "-c", "import time; print('ready', flush=True); time.sleep(60)"], b"ready", tmp_path)
    assert code != 130 and "Traceback" in text
