"""Where long work stands: a bar on a terminal, plain lines elsewhere."""

from __future__ import annotations

import contextlib
import math
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator

from backdrive_bayes.commands.output import in_encoding_of

PLAIN_SECONDS = 5.0
REDRAW_SECONDS = 0.5
CELLS = 20


@contextlib.contextmanager
def progress(budget_s: float | None = None) -> Iterator[Callable[..., None]]:
    """Yield ``note(text, share=None)``: a bar redrawn on a terminal, elsewhere plain lines every few seconds.

    The bar shows ``share`` of the work where a note says so, else the time that has passed of ``budget_s``; without either a
    block runs to and fro. Before the first note nothing is written, and on a terminal nothing stays.
    """
    shown = _Bar(sys.stderr, budget_s) if sys.stderr.isatty() else _Plain(sys.stderr)
    try:
        yield shown.note
    finally:
        shown.close()


class _Plain:
    def __init__(self, stream):
        self.stream, self.began, self.last = stream, time.monotonic(), -math.inf

    def note(self, text, share=None):
        now = time.monotonic()
        if now - self.last >= PLAIN_SECONDS:
            self.stream.write(in_encoding_of(self.stream, f"{now - self.began:.0f} s  {text}\n"))
            self.stream.flush()
            self.last = now

    def close(self):
        pass


class _Bar:
    """Drawn by a thread of its own, because notes may be half a minute apart."""

    def __init__(self, stream, budget_s):
        self.stream, self.budget_s, self.began = stream, budget_s, time.monotonic()
        self.text, self.share = "", None
        self.done, self.thread = threading.Event(), None

    def note(self, text, share=None):
        self.text, self.share = text, share
        if self.thread is None:
            self.thread = threading.Thread(target=self._run, daemon=True)
            self.thread.start()

    def close(self):
        if self.thread is not None:
            self.done.set()
            self.thread.join()
            self._write("")

    def _run(self):
        while True:
            passed = time.monotonic() - self.began
            self._write(line(passed, self.budget_s, self.text, self.share))
            if self.done.wait(REDRAW_SECONDS):
                return

    def _write(self, text):
        width = shutil.get_terminal_size().columns
        self.stream.write("\r\x1b[K" + in_encoding_of(self.stream, text.replace("\n", " "))[: width - 1])
        self.stream.flush()


def line(passed_s: float, budget_s: float | None, text: str, share: float | None = None) -> str:
    """One state of the bar, as text without control characters."""
    if share is None and budget_s:
        share = passed_s / budget_s
    if share is None:
        at = round(passed_s / REDRAW_SECONDS) % (2 * CELLS - 2)
        bar = "".join("#" if i == min(at, 2 * CELLS - 2 - at) else "-" for i in range(CELLS))
    else:
        full = int(CELLS * min(max(share, 0.0), 1.0))
        bar = "#" * full + "-" * (CELLS - full)
    of = f" of {budget_s:.0f}" if budget_s and passed_s < budget_s else ""
    return f"[{bar}] {passed_s:.0f}{of} s  {text}"
